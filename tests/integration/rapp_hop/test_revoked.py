"""On the robot: what a revoked publisher has signed goes, what was only yanked stays. Real trust client, real store."""

import asyncio
import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

import pytest

from fakes.packages import source_folder
from fakes.store_client import StoreClient
from rapp_cloud.shelf import Shelf
from rapp_hop.errors import Unreachable
from rapp_hop.hz.archive import build
from rapp_hop.hz.delivery import Delivery
from rapp_hop.hz.trust import Attack, TrustedStore, Untrusted

NAMES = {"hello": "rapp", "clock": "maria"}  # RApps by publisher


class Robot:
    """Has hello and maria's clock, 1.0.0 each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.shelf = Shelf(folder / "tuf", folder / "keys")
        self.shelf.create()
        self.shelf.custody.add("maria")
        root = (folder / "tuf/metadata/1.root.json").read_bytes()
        self.client = StoreClient(folder / "tuf")
        self.delivery = Delivery(self.client, root, folder / "robot")  # type: ignore[arg-type]
        for name in NAMES:
            self.publish(name)
            self.install(name)

    def publish(self, name: str, version: str = "1.0.0") -> None:
        source = self.folder / "sources"
        shutil.rmtree(source, ignore_errors=True)
        self.shelf.publish(build(source_folder(source, name, version)), publisher=NAMES[name])

    def install(self, name: str) -> str:
        return asyncio.run(self.delivery.install(name)).version

    def drop(self) -> set[str]:
        """What a look at the store removes."""
        return set(asyncio.run(self.delivery.drop_revoked()))

    @property
    def rapps(self) -> dict[str, str]:
        return {name: manifest.version.text for name, manifest in self.delivery.folder.list().items()}


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot(tmp_path)


def test_what_a_revoked_publisher_has_signed_goes_also_while_it_runs(robot: Robot) -> None:
    package = robot.folder / "robot" / "runs" / "r1" / "package"
    package.mkdir(parents=True)
    (package / "package.json").write_text('{"name": "clock"}')
    assert robot.drop() == set()
    robot.shelf.custody.revoke("maria")
    assert robot.drop() == {"clock"}
    assert robot.rapps == {"hello": "1.0.0"}
    assert robot.drop() == set()


def test_an_installation_that_meets_a_revoked_publisher_is_refused_and_removes(robot: Robot) -> None:
    robot.shelf.custody.revoke("maria")
    with pytest.raises(Untrusted) as caught:
        robot.install("clock")
    assert caught.value.attack is Attack.REVOKED
    assert robot.rapps == {"hello": "1.0.0"}


def test_a_yanked_version_stays(robot: Robot) -> None:
    robot.shelf.yank("clock", "1.0.0")
    assert robot.drop() == set()
    assert robot.rapps["clock"] == "1.0.0"


@pytest.mark.parametrize(("again", "gone"), [("1.0.0", set()), ("1.0.1", {"clock"})])
def test_a_robot_that_was_away_keeps_only_what_the_new_key_has_signed_again(robot: Robot, again: str, gone: set[str]) -> None:
    robot.shelf.custody.revoke("maria")
    robot.shelf.custody.add("maria")
    robot.publish("clock", again)
    assert robot.drop() == gone
    assert robot.install("clock") == again
    assert robot.drop() == set()


def test_a_new_version_that_comes_while_the_old_one_is_found_revoked_stays(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    robot.shelf.custody.revoke("maria")
    robot.shelf.custody.add("maria")
    robot.publish("clock", "1.0.1")
    look = TrustedStore.revoked

    def look_and_install(store: TrustedStore, installed: Mapping[str, Collection[str]]) -> frozenset[str]:
        found = look(store, installed)
        robot.install("clock")
        return found

    monkeypatch.setattr(TrustedStore, "revoked", look_and_install)
    assert robot.drop() == set()
    assert robot.rapps["clock"] == "1.0.1"


def test_the_version_before_a_new_one_goes_too(robot: Robot) -> None:
    robot.publish("clock", "1.1.0")
    robot.install("clock")
    robot.shelf.custody.revoke("maria")
    assert robot.drop() == {"clock"}
    assert not (robot.folder / "robot" / "rapps" / "clock").exists()


def test_a_rotated_key_is_not_a_revoked_one(robot: Robot) -> None:
    robot.shelf.custody.rotate("maria")
    assert robot.drop() == set()


def test_a_store_that_is_away_removes_nothing(robot: Robot) -> None:
    robot.shelf.custody.revoke("maria")
    (robot.folder / "tuf" / "metadata" / "timestamp.json").unlink()
    with pytest.raises(Unreachable):
        robot.drop()
    assert robot.rapps.keys() == NAMES.keys()
