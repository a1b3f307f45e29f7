"""`./rapp remove` when there is nothing to remove, or nobody to do it."""

import argparse
import asyncio
import json
from typing import Any

import pytest

from fakes.rapps import install_rapp
from rapp_cli.errors import CommandError
from rapp_cli.home import remove
from rapp_cli.home.place import Home, Settings


@pytest.fixture
def home(tmp_path_factory: pytest.TempPathFactory) -> Home:
    home = Home(tmp_path_factory.mktemp("x"))
    home.make()
    return home


@pytest.mark.parametrize(
    ("name", "told"), [("parrot", "not installed; ./rapp status"), ("../clock", "RApp of this name"), ("", "RApp of this name")]
)
def test_what_is_not_there_is_told(home: Home, name: str, told: str) -> None:
    install_rapp(home.robot, "clock")
    with pytest.raises(CommandError, match=told):
        remove.run(argparse.Namespace(rapp=name, home=home.folder))
    assert (home.robot / "rapps" / "clock").exists()


class Bridge:
    """Sends these messages, and leaves."""

    def __init__(self, *messages: dict[str, Any]) -> None:
        self.messages = list(messages)

    async def read_message(self) -> str | None:
        return json.dumps(self.messages.pop(0)) if self.messages else None


def test_what_the_bridge_tells_of_itself_is_not_the_end() -> None:
    status = {"op": "status", "level": "error", "msg": "cannot reach the ROS master"}
    done = {"op": "publish", "topic": "/rapp_hop/events", "msg": {"job": "j", "kind": remove.DONE, "message": ""}}
    bridge: Any = Bridge(status, done, status)
    asyncio.run(remove._ended(bridge, {"j"}))
    assert bridge.messages == [status]


class Silent:
    """A bridge that takes all and answers nothing."""

    def __init__(self) -> None:
        self.written: list[dict[str, Any]] = []

    async def write_message(self, text: str) -> None:
        self.written.append(json.loads(text))

    async def read_message(self) -> str:
        await asyncio.Event().wait()
        raise AssertionError

    def close(self) -> None:
        pass


def test_the_link_is_asked_now_and_then_and_none_of_its_jobs_outlives_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    silent = Silent()

    async def connect(_bridge: str, connect_timeout: float) -> Silent:
        return silent

    monkeypatch.setattr(remove, "websocket_connect", connect)
    for name, seconds in (("PATIENCE", 0.5), ("AGAIN", 0.01), ("MARGIN", 0.001)):
        monkeypatch.setattr(remove, name, seconds)
    with pytest.raises(TimeoutError):
        asyncio.run(remove._remove("ws://bridge", "clock"))
    patience = [wish["args"]["timeout"] for wish in silent.written if wish["op"] == "call_service"]
    assert max(patience) < 0.5
    assert patience == sorted(set(patience), reverse=True)
    assert len(patience) < 8  # their pauses double


def test_a_robot_that_is_not_up_is_to_be_started(home: Home) -> None:
    install_rapp(home.robot, "clock")
    home.keep(Settings("nao", None, None, None, (), {"rosbridge": 1}))
    with pytest.raises(CommandError, match=r"the robot is away .*start it with ./rapp up"):
        remove.run(argparse.Namespace(rapp="clock", home=home.folder))
