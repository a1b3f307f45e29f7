"""Reports of runs and a platform that answers oddly: only what is wrong with the report itself is dropped."""

import asyncio
from pathlib import Path
from typing import Any

import pytest

from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_link.cloud_side import Identity, Platform
from rapp_link.config import Config
from rapp_link.reports import Reports

ODD = [Bug("500", 500), Refused("404", 404), Refused("403", 403), Refused("302", 302), Invalid("a page")]
WRONG = [Invalid("400", 400), Refused("413", 413)]


class FakeClient:
    """Takes reports; `errors` are raised for the runs they name."""

    def __init__(self) -> None:
        self.errors: dict[str, HopError] = {}
        self.taken: list[str] = []

    async def call(self, service: str, args: dict[str, Any], timeout: float) -> dict[str, bool]:
        """Answer a registration, a heartbeat or a report."""
        if service == "report":
            name = args["run"]["run"]
            if name in self.errors:
                raise self.errors[name]
            self.taken.append(name)
        return {"registered": True}


class Robot:
    """A link's reports and its side towards the platform."""

    def __init__(self, folder: Path) -> None:
        self.client = FakeClient()
        self.reports = Reports(folder / "reports")
        config = Config(folder)
        self._platform = Platform(self.client, config, self.reports)  # type: ignore[arg-type]

    def keep(self, *names: str) -> None:
        """Let runs wait."""
        for name in names:
            self.reports.keep({"run": name})

    def round(self) -> None:
        """Do what follows a heartbeat."""
        asyncio.run(self._platform._send_reports(Identity("nao", "nao", "1.0")))


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """A robot without reports."""
    return Robot(tmp_path)


@pytest.mark.parametrize("error", ODD, ids=str)
def test_what_is_answered_oddly_is_sent_later_and_blocks_no_other(robot: Robot, error: HopError) -> None:
    robot.keep("first", "second", "third")
    robot.client.errors["first"] = error
    robot.round()
    robot.round()
    assert robot.client.taken == ["second", "third"]
    assert len(robot.reports.waiting()) == 1
    robot.client.errors.clear()
    robot.round()
    assert robot.client.taken[2:] == ["first"]
    assert robot.reports.waiting() == []


@pytest.mark.parametrize("error", WRONG, ids=str)
def test_what_the_platform_finds_wrong_is_dropped(robot: Robot, error: HopError) -> None:
    robot.keep("first", "second")
    robot.client.errors["first"] = error
    robot.round()
    assert robot.client.taken == ["second"]
    assert robot.reports.waiting() == []
    assert not robot.reports.keep({"run": "first"})


def test_what_cannot_be_read_is_dropped(robot: Robot) -> None:
    robot.keep("first", "second")
    robot.reports.waiting()[0].write_text("{")
    robot.round()
    assert robot.client.taken == ["second"]
    assert robot.reports.waiting() == []


@pytest.mark.parametrize("error", [Unreachable("503", 503), Refused("401", 401)], ids=str)
def test_a_platform_that_is_away_or_lets_nobody_in_gets_no_more(robot: Robot, error: HopError) -> None:
    robot.keep("first", "second")
    robot.client.errors["first"] = error
    with pytest.raises(type(error)):
        robot.round()
    assert robot.client.taken == []
    assert len(robot.reports.waiting()) == 2
