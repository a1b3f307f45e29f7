"""Updates of a RApp on a whole robot: one that does not start gives way, one that is cut off comes later, no cloud is no matter."""

import json
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from fakes import faulty_cloud
from fakes.rapps import write_rapp
from fakes.robot_behind_faults import RobotBehindFaults
from fakes.whole_robot import processes_of
from rapp_cloud.app import open_shelf
from rapp_hop.hz.archive import build

pytestmark = [pytest.mark.system, pytest.mark.timeout(120)]

NAME = "fresh"


def package(folder: Path, version: str) -> Path:
    """Says its version."""
    return write_rapp(folder / version, NAME, f"communication.rapp_say('fresh {version}')", version=version)


def publish(robot: RobotBehindFaults, source: Path) -> None:
    open_shelf(robot.data).publish(build(source))


def updated(robot: RobotBehindFaults, version: str) -> None:
    """The robot has heard of a version and runs it."""
    ran = robot.say_until(NAME, lambda seen: (seen.kind, seen.detail) == ("said", f"fresh {version}"), len(robot.seen))
    robot.until_listening(robot.seen.index(ran))


def versions(robot: RobotBehindFaults) -> list[str]:
    return sorted(path.name for path in (robot.home / "rapps" / NAME).iterdir())


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RobotBehindFaults]:
    folder = tmp_path_factory.mktemp("updates")
    robot = RobotBehindFaults(folder, [package(folder / "store", "1.0.0")])
    robot.settings = "catalogue_again = 0.5\n"
    try:
        robot.start()
        robot.served(NAME, "fresh 1.0.0")
        yield robot
    finally:
        robot.close()
    assert processes_of(folder) == []


def test_a_version_that_does_not_start_gives_way_and_is_reported(robot: RobotBehindFaults, tmp_path: Path) -> None:
    broken = package(tmp_path, "1.1.0")
    (broken / "agent.py").write_text("def broken(:\n")
    publish(robot, broken)
    since = len(robot.seen)
    robot.say_until(NAME, lambda seen: seen.detail == "link->core installed (asynchronous)", since)
    assert robot.refused(since) == "The new version did not start, the one before is back"
    assert [message for message in robot.messages(since) if "fresh 1.1.0 did not start (SyntaxError" in message]
    assert versions(robot) == ["1.0.0", "current", "failed"]
    robot.served(NAME, "fresh 1.0.0")
    robot.wait_for(lambda: any(run.get("rolled_back", {}).get("from") == "1.1.0" for run in reported(robot)))


def reported(robot: RobotBehindFaults) -> list[dict[str, dict[str, str]]]:
    """What the platform has been told of runs."""
    with sqlite3.connect(robot.data / "platform.sqlite") as database:
        return [json.loads(text) for (text,) in database.execute("select report from runs")]


def test_the_next_version_comes_and_the_one_before_goes_when_it_has_started(robot: RobotBehindFaults, tmp_path: Path) -> None:
    publish(robot, package(tmp_path, "1.1.1"))
    updated(robot, "1.1.1")
    robot.wait_for(lambda: versions(robot)[:1] == ["1.1.1"])
    assert "previous" not in versions(robot)


def test_a_link_killed_while_it_downloads_leaves_what_works_and_goes_on_later(robot: RobotBehindFaults, tmp_path: Path) -> None:
    publish(robot, package(tmp_path, "1.2.0"))
    robot.cloud_line.set("/tuf/targets/", faulty_cloud.half)
    since = len(robot.seen)
    robot.say_until(NAME, lambda seen: seen.detail == "link->core downloading (asynchronous)", since)
    robot.cloud_line.wait_reached()
    robot.kill("link")
    said = robot.until(lambda seen: seen.kind == "said", since)
    assert said.detail == "fresh 1.1.1"
    robot.until_listening(robot.seen.index(said))
    robot.cloud_line.mend()
    robot.start("link")
    updated(robot, "1.2.0")
    assert list((robot.home / "downloads").iterdir()) == []


def test_without_the_cloud_it_runs_from_the_disk(robot: RobotBehindFaults) -> None:
    robot.kill("cloud")
    robot.served(NAME, "fresh 1.2.0")
    robot.start("cloud")
