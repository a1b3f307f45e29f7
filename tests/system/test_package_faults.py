"""A package changed on its way, signed by a stranger, older than what the robot has: refused before it is unpacked, and said."""

import shutil
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest

from fakes import faulty_cloud
from fakes.rapps import write_rapp
from fakes.robot_behind_faults import RobotBehindFaults
from fakes.whole_robot import processes_of
from rapp_cloud.app import open_shelf
from rapp_cloud.shelf import Expiry, Shelf
from rapp_hop.hz.archive import build

pytestmark = [pytest.mark.system, pytest.mark.timeout(120)]

NAME = "fresh"
STORE = "/tuf/"


def package(folder: Path, version: str) -> Path:
    """Says its version."""
    words = f"communication.rapp_say('fresh {version}')"
    return write_rapp(folder, NAME, words, version=version)


def published(folder: Path, source: Path) -> Path:
    """A store that nobody has told the robot of."""
    shelf = open_shelf(folder)
    shelf.create()
    shelf.publish(build(source))
    return folder / "tuf"


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RobotBehindFaults]:
    folder = tmp_path_factory.mktemp("package")
    robot = RobotBehindFaults(folder, [package(folder / "one", "1.0.0")])
    robot.settings = "catalogue_again = 0.5\n"
    try:
        robot.start()
        robot.served(NAME, "fresh 1.0.0")
        shutil.copytree(robot.data / "tuf", folder / "old")
        open_shelf(robot.data).publish(build(package(folder / "two", "2.0.0")))
        ran = robot.say_until(NAME, lambda seen: (seen.kind, seen.detail) == ("said", "fresh 2.0.0"), len(robot.seen))
        robot.until_listening(robot.seen.index(ran))
        yield robot
    finally:
        robot.close()
    assert processes_of(folder) == []


def asked_and_refused(robot: RobotBehindFaults) -> str:
    """Ask for the RApp; nothing of it may come onto the disk. Gives what the robot says."""
    before, since = unpacked(robot), len(robot.seen)
    robot.ask(NAME, "s6")
    words = robot.refused(since)
    assert unpacked(robot) == before
    assert not [message for message in robot.messages(since) if "verified" in message or "installed" in message]
    return words


def unpacked(robot: RobotBehindFaults) -> dict[str, int]:
    """All folders and files of installed RApps, and when each was changed last (ns): a folder that was there for a moment shows."""
    return {str(path): path.lstat().st_mtime_ns for path in [robot.home / "rapps", *(robot.home / "rapps").rglob("*")]}


def served_again(robot: RobotBehindFaults) -> None:
    robot.cloud_line.mend()
    robot.served(NAME, "fresh 2.0.0")


def test_changed_on_its_way(robot: RobotBehindFaults) -> None:
    robot.forget(NAME)
    robot.cloud_line.set(f"{STORE}targets/", faulty_cloud.changed)
    assert asked_and_refused(robot) == "I refuse to install fresh, it was changed on its way"
    served_again(robot)


def test_signed_by_a_stranger(robot: RobotBehindFaults, tmp_path: Path) -> None:
    robot.forget(NAME)
    store = published(tmp_path / "stranger", package(tmp_path / "three", "3.0.0"))
    robot.cloud_line.set(STORE, faulty_cloud.out_of(store, STORE))
    assert asked_and_refused(robot) == "I refuse to install fresh, it is not signed by my store"
    served_again(robot)


def test_older_than_what_the_robot_has_seen(robot: RobotBehindFaults) -> None:
    robot.forget(NAME)
    robot.cloud_line.set(STORE, faulty_cloud.out_of(robot.folder / "old", STORE))
    assert asked_and_refused(robot) == "I refuse to install fresh, it is older than what I had"
    served_again(robot)


def test_older_than_the_one_installed(robot: RobotBehindFaults, tmp_path: Path) -> None:
    here = robot.home / "rapps" / NAME
    package(here / "9.0.0", "9.0.0")
    (here / "current").unlink()
    (here / "current").symlink_to("9.0.0")
    assert asked_and_refused(robot) == "I refuse to install fresh, it is older than what I had"
    assert (here / "current").readlink() == Path("9.0.0")
    robot.forget(NAME)
    served_again(robot)


def test_lists_that_have_run_out(robot: RobotBehindFaults, tmp_path: Path) -> None:
    robot.forget(NAME)
    shutil.copytree(robot.data / "tuf", tmp_path / "tuf")
    Shelf(tmp_path / "tuf", robot.data / "keys", Expiry(timestamp=timedelta(seconds=-5))).refresh()
    robot.cloud_line.set(STORE, faulty_cloud.out_of(tmp_path / "tuf", STORE))
    assert asked_and_refused(robot) == "I refuse to install fresh, the store shows me an old state"
    served_again(robot)
