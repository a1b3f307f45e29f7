"""The shelf signs what a robot will believe, and never two things under one name."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from tuf.api.metadata import Metadata

from fakes.packages import source_folder
from fakes.store_folder import StoreFolder
from rapp_cloud.shelf import Expiry, Shelf
from rapp_hop.errors import Bug, Invalid, Refused
from rapp_hop.hz.archive import build
from rapp_hop.hz.trust import Attack, TrustedStore, Untrusted, choose


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.create()
    return shelf


@pytest.fixture
def robot(shelf: Shelf, tmp_path: Path) -> TrustedStore:
    return TrustedStore(StoreFolder(tmp_path / "tuf"), "store:", shelf.root_file.read_bytes(), tmp_path / "trust")


def package(folder: Path, name: str = "hello", version: str = "1.0.0", program: str = "pass\n", **rapp: Any) -> bytes:
    return build(source_folder(folder / program.strip(), name, version, program, **rapp))


def offered(robot: TrustedStore, name: str = "hello") -> list[str]:
    return [release.version.text for release in robot.versions(name).releases]


def version_of(path: Path) -> int:
    return Metadata.from_file(str(path)).signed.version


def test_keys_are_private(shelf: Shelf, tmp_path: Path) -> None:
    assert (tmp_path / "keys").stat().st_mode & 0o777 == 0o700
    files = list((tmp_path / "keys").iterdir())
    assert sorted(path.name for path in files) == sorted(
        ["passphrase", "rapp.pem", "root.pem", "snapshot.pem", "targets.pem", "timestamp.pem"]
    )
    assert all(path.read_bytes().startswith(b"-----BEGIN ENCRYPTED") for path in files if path.suffix == ".pem")
    assert {path.stat().st_mode & 0o777 for path in files} == {0o600}
    assert not any(b"PRIVATE" in path.read_bytes() for path in (tmp_path / "tuf").rglob("*.json"))


def test_what_is_published_arrives_verified(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    data = package(tmp_path)
    assert shelf.publish(data).name == "hello"
    release = choose(robot.versions("hello"), "hello")
    robot.download(release, tmp_path / "got.hz")
    assert (tmp_path / "got.hz").read_bytes() == data
    assert release.target.custom == {"name": "hello", "version": "1.0.0"}
    assert [manifest.name for manifest in shelf.manifests()] == ["hello"]


def test_a_package_is_unpacked_for_the_platform_itself(shelf: Shelf, tmp_path: Path) -> None:
    shelf.publish(package(tmp_path, program="pass\n"))
    shelf.unpack("hello", "1.0.0", tmp_path / "there")
    assert (tmp_path / "there" / "agent.py").read_text() == "pass\n"
    with pytest.raises(Refused, match="not in the store"):
        shelf.unpack("hello", "2.0.0", tmp_path / "other")
    (target,) = shelf.targets.iterdir()
    target.write_bytes(target.read_bytes()[:-1] + b"?")
    with pytest.raises(Bug, match="backup"):
        shelf.unpack("hello", "1.0.0", tmp_path / "changed")


def test_s20_the_same_version_with_other_bytes(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    shelf.publish(package(tmp_path))
    before = version_of(shelf.metadata / "timestamp.json")
    shelf.publish(package(tmp_path / "again"))
    assert version_of(shelf.metadata / "timestamp.json") == before
    with pytest.raises(Refused, match="raise its version"):
        shelf.publish(package(tmp_path, program="evil()\n"))
    assert len(offered(robot)) == 1


def test_two_versions_stay_on_offer(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    shelf.publish(package(tmp_path))
    shelf.publish(package(tmp_path, version="1.0.1"))
    assert offered(robot) == ["1.0.0", "1.0.1"]


def test_words_of_another_and_older_versions_are_not_published(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    shelf.publish(package(tmp_path, version="1.0.1"))
    with pytest.raises(Refused, match="is what one says for hello"):
        shelf.publish(package(tmp_path, "parrot", keywords={"en": ["hello"]}))
    with pytest.raises(Refused, match=r"1\.0\.1 is on offer"):
        shelf.publish(package(tmp_path))
    with pytest.raises(Refused, match="to stop the robot"):
        shelf.publish(package(tmp_path, "hello", "1.0.2", keywords={"en": ["stop"]}))
    shelf.publish(package(tmp_path, version="1.1.0"))
    shelf.publish(package(tmp_path / "again", version="1.0.1"))  # on offer unchanged, as at each start
    assert offered(robot) == ["1.0.1", "1.1.0"]


def test_a_wrong_package_is_not_published(shelf: Shelf, robot: TrustedStore) -> None:
    with pytest.raises(Invalid):
        shelf.publish(b"<html>")
    assert offered(robot) == []


def test_refresh_signs_a_new_timestamp_only(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    shelf.publish(package(tmp_path))
    robot.versions("hello")
    targets = sorted(shelf.metadata.glob("*.targets.json"))
    before = version_of(shelf.metadata / "timestamp.json")
    shelf.refresh()
    assert version_of(shelf.metadata / "timestamp.json") == before + 1
    assert sorted(shelf.metadata.glob("*.targets.json")) == targets
    assert len(offered(robot)) == 1


def test_refresh_signs_everything_whose_time_is_half_over(tmp_path: Path) -> None:
    short = Expiry(targets=timedelta(days=10), snapshot=timedelta(days=10))
    Shelf(tmp_path / "tuf", tmp_path / "keys", short).create()
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.refresh()
    expires = Metadata.from_file(str(shelf.metadata / "2.targets.json")).signed.expires
    assert expires > datetime.now(UTC) + timedelta(days=80)


def test_s04_a_store_that_nobody_refreshes_is_not_believed(tmp_path: Path) -> None:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys", Expiry(timestamp=timedelta(seconds=-1)))
    shelf.create()
    robot = TrustedStore(StoreFolder(tmp_path / "tuf"), "store:", shelf.root_file.read_bytes(), tmp_path / "trust")
    with pytest.raises(Untrusted) as caught:
        robot.versions("hello")
    assert caught.value.attack == Attack.FREEZE


def test_create_twice_keeps_the_keys(shelf: Shelf, tmp_path: Path) -> None:
    before = {path: path.read_bytes() for path in (tmp_path / "keys").iterdir()}
    with pytest.raises(Refused, match="there is one"):
        shelf.create()
    shelf.root_file.unlink()
    with pytest.raises(Refused, match="keep them"):
        shelf.create()
    assert {path: path.read_bytes() for path in (tmp_path / "keys").iterdir()} == before


def test_keys_that_others_can_read_are_not_used(shelf: Shelf, tmp_path: Path) -> None:
    (tmp_path / "keys" / "timestamp.pem").chmod(0o644)
    with pytest.raises(Refused, match="0600"):
        shelf.refresh()


def test_no_store_and_no_key_say_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "tuf").mkdir()
    with pytest.raises(Refused, match="rapp_cloud init"):
        Shelf(tmp_path / "tuf", tmp_path / "keys").manifests()


def test_a_package_changed_behind_our_back(shelf: Shelf, tmp_path: Path) -> None:
    shelf.publish(package(tmp_path))
    next(shelf.targets.glob("*.hz")).write_bytes(b"evil")
    with pytest.raises(Bug, match="restore it"):
        shelf.manifests()


def test_a_publication_cut_short_before_the_timestamp_changes_nothing_and_can_be_repeated(
    shelf: Shelf, robot: TrustedStore, tmp_path: Path
) -> None:
    before = (shelf.metadata / "timestamp.json").read_bytes()
    shelf.publish(package(tmp_path))
    (shelf.metadata / "timestamp.json").write_bytes(before)  # power went before the last rename
    assert offered(robot) == []
    shelf.publish(package(tmp_path / "again"))
    assert offered(robot) == ["1.0.0"]
