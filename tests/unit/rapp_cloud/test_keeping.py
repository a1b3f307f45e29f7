"""Profiles, registrations, settings."""

from pathlib import Path

import pytest

from rapp_cloud.catalogue import RobotKind
from rapp_cloud.config import load_config
from rapp_cloud.files import write_whole
from rapp_cloud.profiles import MAX_CONTACTS, Profile, parse_profile
from rapp_cloud.robots import Robots
from rapp_core.services.recognise import MOST
from rapp_hop.errors import Invalid, Refused

NAO = RobotKind("nao", "1.0")


@pytest.mark.parametrize(
    "address", ["", "m", "@x", "m@", "a@b@c", "m@x\nBcc: all@x", "m@x, n@x", "<m@x>", '"m"@x', "m @x", "m@x y"]
)
def test_h19_addresses_that_are_none(address: str) -> None:
    with pytest.raises(Invalid, match="not a mail address"):
        parse_profile({"name": "M", "language": "en", "contacts": [{"name": "x", "address": address}]})


@pytest.mark.parametrize(
    "value",
    [[], {}, {"name": "M"}, {"name": "M", "language": "en", "contacts": {}}, {"name": "M", "language": "en", "contacts": ["x"]},
     {"name": "M\n", "language": "en"}, {"name": 3, "language": "en"}, {"name": "M", "language": "english"},
     {"name": "M", "language": "en", "contacts": [{"name": "x"}]},
     {"name": "M", "language": "en", "contacts": [{"name": f"x{number}", "address": "a@b"} for number in range(101)]}],
)  # fmt: skip
def test_broken_profiles(value: object) -> None:
    with pytest.raises(Invalid):
        parse_profile(value)


def named(*names: str) -> Profile:
    return parse_profile({"name": "M", "language": "en", "contacts": [{"name": name, "address": "a@b"} for name in names]})


def test_a_robot_can_listen_for_all_contacts_of_a_profile() -> None:
    assert MAX_CONTACTS == MOST
    assert len(named(*(f"x{number}" for number in range(MAX_CONTACTS))).contacts) == MAX_CONTACTS


@pytest.mark.parametrize("name", ["...", "†", " _ "])
def test_a_contact_whom_nobody_can_name_is_refused(name: str) -> None:
    with pytest.raises(Invalid, match=r"nobody can say .*; give the contact a name with letters"):
        named("Elizabeth", name)


@pytest.mark.parametrize(("one", "other"), [("Anna", "Anna"), ("Anna", "anna"), ("Anne-Marie", "Anne Marie"), ("J. Doe", "J Doe")])
def test_contacts_whose_names_sound_the_same_are_refused(one: str, other: str) -> None:
    with pytest.raises(Invalid, match=f"'{other}' sounds like '{one}'"):
        named(one, "Żaneta", "李雷", other)


def test_a_lease_ends_without_heartbeats_and_lives_with_them() -> None:
    now = [100.0]
    robots = Robots(lambda: now[0], lease=10)
    assert not robots.heartbeat("nao")
    with pytest.raises(Refused, match="call register first"):
        robots.kind_of("nao")
    robots.register("nao", NAO)
    for _ in range(5):
        now[0] += 9
        assert robots.heartbeat("nao")
    assert robots.kind_of("nao") == NAO
    now[0] += 10
    assert not robots.heartbeat("nao")
    with pytest.raises(Refused):
        robots.kind_of("nao")
    robots.register("nao", RobotKind("nao", "1.1"))
    assert robots.kind_of("nao").api_version == "1.1"


def test_write_whole_leaves_the_old_file_when_it_fails(tmp_path: Path) -> None:
    write_whole(tmp_path / "x", b"old", mode=0o600)
    (tmp_path / "folder").mkdir()
    with pytest.raises(OSError):
        write_whole(tmp_path / "folder", b"new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "x"]


def test_settings_file_then_environment_then_options(tmp_path: Path) -> None:
    (tmp_path / "cloud.toml").write_text('port = 1\nworkers = 3\nlease = 5\npublish = ["a"]\n')
    config = load_config(tmp_path, {"port": 0, "address": None}, {"RAPP_CLOUD_PORT": "2", "RAPP_CLOUD_WORKERS": "4"})
    assert (config.port, config.workers, config.lease, config.publish) == (0, 4, 5.0, (Path("a"),))
    assert config.address == "127.0.0.1"


@pytest.mark.parametrize(
    "text", ["port = 'x'", "prot = 1", "port = -1", "publish = 'x'", "lease = nan", "port =", "database = 3", "port = true"]
)
def test_o04_wrong_settings_are_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "cloud.toml").write_text(text)
    with pytest.raises(Invalid, match="cannot"):
        load_config(tmp_path, {}, {})
