"""The end of a dynamic agent's life: it stops its cloud agent, last of all, and only then says "gone" (deliverable section 3.2)."""

import queue
from pathlib import Path
from typing import Any

import pytest

from fakes.rapps import write_rapp
from rapp_api.errors import Unreachable
from rapp_api.life import Bounds, live
from rapp_api.testing import FakeCoreAgent

WORKS, DISMANTLES = "communication.rapp_say('working')", "communication.rapp_say('dismantling')"


class FakeChannel:
    """The core agent asks for dismantling as soon as "terminate" came; `core` notes what is sent among its calls."""

    def __init__(self, core: FakeCoreAgent) -> None:
        self._core = core
        self._orders: queue.Queue[dict[str, Any] | None] = queue.Queue()

    def send(self, **message: Any) -> None:
        if message["type"] in ("terminate", "gone"):
            self._core.calls.append((message["type"], None))
        if message["type"] == "terminate":
            self._orders.put({"type": "dismantle"})
        elif message["type"] == "gone":
            self._orders.put(None)

    def receive(self) -> dict[str, Any] | None:
        return self._orders.get(timeout=20)


def story(core: FakeCoreAgent, folder: Path, body: str, end: str = "pass", *, cloud_agent: bool = True) -> list[str]:
    """What a RApp does that executes `body` and dismantles with `end`."""
    package = write_rapp(folder / "package", "probe", body)
    with (package / "agent.py").open("a") as program:
        program.write(f"\n    def dismantle(self) -> None:\n        {end}\n")
    order = {"package": str(package), "entry": "agent.py", "parameters": {}, "cloud_agent": cloud_agent}
    with core:
        live(FakeChannel(core), order, lambda: None, Bounds())
    return [str(argument) if name == "say" else name for name, argument in core.calls]


def test_the_cloud_agent_is_stopped_after_all_else_and_before_gone(tmp_path: Path) -> None:
    ended = story(FakeCoreAgent(agent_services={}), tmp_path, WORKS, DISMANTLES)
    assert ended == ["working", "terminate", "dismantling", "stop_cloud_agent", "gone"]


def test_without_a_cloud_agent_none_is_stopped(tmp_path: Path) -> None:
    ended = story(FakeCoreAgent(), tmp_path, WORKS, DISMANTLES, cloud_agent=False)
    assert ended == ["working", "terminate", "dismantling", "gone"]


@pytest.mark.parametrize(
    "body", ["raise ValueError('on purpose')", "pass\n\n    def dismantle(self) -> None:\n        1 / 0", "x = = 1"]
)
def test_a_rapp_that_fails_stops_its_cloud_agent_all_the_same(tmp_path: Path, body: str) -> None:
    assert story(FakeCoreAgent(agent_services={}), tmp_path, body, cloud_agent=True)[-3:] == [
        "terminate",
        "stop_cloud_agent",
        "gone",
    ]


def test_a_cloud_agent_that_cannot_be_stopped_does_not_keep_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    core = FakeCoreAgent(agent_services={})

    def away() -> bool:
        raise Unreachable("cannot reach the link")

    monkeypatch.setattr(core, "stop_cloud_agent", away)
    assert story(core, tmp_path, "pass") == ["terminate", "gone"]
