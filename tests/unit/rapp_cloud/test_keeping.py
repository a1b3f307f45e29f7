"""Accounts, profiles, registrations, reports, settings."""

import json
from pathlib import Path

import pytest

from rapp_cloud import reports
from rapp_cloud.accounts import Accounts
from rapp_cloud.catalogue import RobotKind
from rapp_cloud.config import load_config
from rapp_cloud.files import write_whole
from rapp_cloud.profiles import Contact, Profile, Profiles, parse_profile
from rapp_cloud.reports import Reports
from rapp_cloud.robots import Robots
from rapp_hop.errors import Invalid, Refused

NAO = RobotKind("nao", "1.0")


def test_tokens_name_robots(tmp_path: Path) -> None:
    accounts = Accounts(tmp_path / "tokens.json")
    assert accounts.robot_of("x" * 32) is None
    one, two = accounts.add("nao"), accounts.add("other")
    assert (accounts.robot_of(one), accounts.robot_of(two)) == ("nao", "other")
    assert (tmp_path / "tokens.json").stat().st_mode & 0o777 == 0o600


def test_h14_wrong_tokens(tmp_path: Path) -> None:
    accounts = Accounts(tmp_path / "tokens.json")
    token = accounts.add("nao")
    for wrong in (None, "", token[:-1], token + "x", token.swapcase(), "é" * 20, "x" * 10_000, f" {token}"):
        assert accounts.robot_of(wrong) is None


def test_a_token_taken_away_counts_no_more(tmp_path: Path) -> None:
    accounts = Accounts(tmp_path / "tokens.json")
    token = accounts.add("nao")
    assert accounts.robot_of(token) == "nao"
    write_whole(tmp_path / "tokens.json", b"{}")
    assert accounts.robot_of(token) is None


@pytest.mark.parametrize("text", ["[]", '{"short": "nao"}', '{"xxxxxxxxxxxxxxxxxxxx": 3}', '{"xxxxxxxxxxxxxxxxxxxx": "../x"}', "{"])
def test_broken_token_files(tmp_path: Path, text: str) -> None:
    (tmp_path / "tokens.json").write_text(text)
    with pytest.raises(Invalid):
        Accounts(tmp_path / "tokens.json").robot_of("x" * 32)


def test_profiles_come_back(tmp_path: Path) -> None:
    profiles = Profiles(tmp_path / "profiles")
    profile = Profile("Maria", "en", (Contact("Małgorzata", "m@home.example"),))
    profiles.put("nao", profile)
    assert profiles.get("nao") == profile
    assert profile.describe()["contacts"] == [{"name": "Małgorzata", "address": "m@home.example"}]
    with pytest.raises(Refused, match="cannot find a profile"):
        profiles.get("other")
    with pytest.raises(Invalid):
        profiles.get("../nao")


@pytest.mark.parametrize(
    "address", ["", "m", "@x", "m@", "a@b@c", "m@x\nBcc: all@x", "m@x, n@x", "<m@x>", '"m"@x', "m @x", "m@x y"]
)
def test_h19_addresses_that_are_none(address: str) -> None:
    with pytest.raises(Invalid, match="not a mail address"):
        parse_profile({"name": "M", "language": "en", "contacts": [{"name": "x", "address": address}]})


@pytest.mark.parametrize(
    "value",
    [[], {}, {"name": "M"}, {"name": "M", "language": "en", "contacts": {}}, {"name": "M", "language": "en", "contacts": ["x"]},
     {"name": "M\n", "language": "en"}, {"name": 3, "language": "en"},
     {"name": "M", "language": "en", "contacts": [{"name": "x"}]},
     {"name": "M", "language": "en", "contacts": [{"name": "x", "address": "a@b"}] * 1001}],
)  # fmt: skip
def test_broken_profiles(value: object) -> None:
    with pytest.raises(Invalid):
        parse_profile(value)


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


def test_reports_are_kept_once_per_run(tmp_path: Path) -> None:
    kept = Reports(tmp_path)
    kept.keep("nao", {"run": "r-1", "outcome": "failed"})
    assert kept.keep("nao", {"run": "r-1", "outcome": "done"}) == "r-1"
    name = kept.keep("nao", {"run": "../../etc/passwd"})
    assert sorted(path.name for path in (tmp_path / "nao").iterdir()) == sorted([f"{name}.json", "r-1.json"])
    assert json.loads((tmp_path / "nao" / "r-1.json").read_text())["outcome"] == "done"


def test_reports_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reports, "KEPT", 3)
    for number in range(6):
        Reports(tmp_path).keep("nao", {"run": f"r{number}"})
    assert len(list((tmp_path / "nao").iterdir())) == 3
    assert (tmp_path / "nao" / "r5.json").exists()


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
    assert config.tokens == tmp_path / "tokens.json"


@pytest.mark.parametrize("text", ["port = 'x'", "prot = 1", "port = -1", "publish = 'x'", "lease = nan", "port ="])
def test_wrong_settings_are_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "cloud.toml").write_text(text)
    with pytest.raises(Invalid, match="cannot"):
        load_config(tmp_path, {}, {})
