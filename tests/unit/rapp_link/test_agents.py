"""The link's table of cloud agents, with a platform in memory."""

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_link import agents as agents_module
from rapp_link.agents import CloudAgents
from rapp_link.files import sorted_out


class FakePlatform:
    """Its agents by run; `error` fails every call, `held` makes starting wait."""

    def __init__(self) -> None:
        self.reachable = True
        self.running: dict[str, str] = {}
        self.calls: list[str] = []
        self.error: HopError | None = None
        self.odd = False
        self.held = asyncio.Event()
        self.held.set()

    async def call(self, service: str, arguments: dict[str, Any], timeout: float) -> Any:
        self.calls.append(service)
        if self.error is not None:
            raise self.error
        if self.odd:
            return ["odd"]
        if service == "start_cloud_agent":
            await self.held.wait()
            return {"agent": self.running.setdefault(arguments["run"], f"id-of-{arguments['run']}")}
        if service == "stop_cloud_agent":
            known = [run for run, agent in self.running.items() if agent == arguments["agent"]]
            return {"stopped": bool([self.running.pop(run) for run in known])}
        return {"agents": [{"run": run, "agent": agent, "rapp": "x"} for run, agent in self.running.items()]}


Test = Callable[[CloudAgents, FakePlatform], Coroutine[Any, Any, None]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[[Test], None]:
    """Runs a test beside the link's look at its agents, with short times."""
    monkeypatch.setattr(agents_module, "LOOK", 0.01)
    monkeypatch.setattr(agents_module, "SILENCE", 0.3)

    def run(test: Test) -> None:
        async def main() -> None:
            platform = FakePlatform()
            agents = CloudAgents(platform)  # type: ignore[arg-type]
            watch = asyncio.create_task(agents.run())
            try:
                await asyncio.wait_for(test(agents, platform), 20)
            finally:
                watch.cancel()
                await asyncio.gather(watch, return_exceptions=True)

        asyncio.run(main())

    return run


async def until(done: Callable[[], bool]) -> None:
    while not done():
        await asyncio.sleep(0.01)


def test_an_agent_is_started_called_and_stopped_by_its_run(run: Callable[[Test], None]) -> None:
    async def test(agents: CloudAgents, platform: FakePlatform) -> None:
        assert await agents.start("hello", "1.0.0", "r1", 5) == "r1"
        assert await agents.address("r1", 5) == "agents/id-of-r1"
        assert await agents.stop("r1", 5)
        assert platform.running == {}
        assert not await agents.stop("r1", 5)
        with pytest.raises(Refused, match="this run has none"):
            await agents.address("r1", 5)

    run(test)


def test_a_link_that_was_started_anew_asks_the_platform(run: Callable[[Test], None]) -> None:
    async def test(agents: CloudAgents, platform: FakePlatform) -> None:
        platform.running["r1"] = "other-id"
        assert await agents.address("r1", 5) == "agents/other-id"
        assert await agents.stop("r1", 5)

    run(test)


def test_a_run_of_which_nothing_is_heard_loses_its_agent(run: Callable[[Test], None]) -> None:
    async def test(agents: CloudAgents, platform: FakePlatform) -> None:
        platform.running["left"] = "of an earlier link"
        await agents.start("hello", "1.0.0", "r1", 5)
        loop = asyncio.get_running_loop()
        begun = loop.time()
        while loop.time() < begun + 1.0:  # longer than the silence
            agents.keep("r1")
            await asyncio.sleep(0.01)
        assert list(platform.running) == ["r1"]
        await until(lambda: not platform.running)

    run(test)


def test_when_no_run_lives_all_agents_go_at_once(run: Callable[[Test], None], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(agents_module, "SILENCE", 1000.0)

    async def test(agents: CloudAgents, platform: FakePlatform) -> None:
        await agents.start("hello", "1.0.0", "r1", 5)
        agents.keep("")
        await until(lambda: not platform.running)

    run(test)


def test_who_stops_waits_for_who_starts(run: Callable[[Test], None]) -> None:
    async def test(agents: CloudAgents, platform: FakePlatform) -> None:
        platform.held.clear()
        starting = asyncio.create_task(agents.start("hello", "1.0.0", "r1", 5))
        await until(lambda: "start_cloud_agent" in platform.calls)
        stopping = asyncio.create_task(agents.stop("r1", 5))
        await asyncio.sleep(0)
        platform.held.set()
        await starting
        assert await stopping
        assert platform.running == {}

    run(test)


def test_a_platform_that_is_away_is_asked_again_later(run: Callable[[Test], None]) -> None:
    async def test(agents: CloudAgents, platform: FakePlatform) -> None:
        await agents.start("hello", "1.0.0", "r1", 5)
        platform.error = Unreachable("cannot reach it")
        with pytest.raises(Unreachable):
            await agents.stop("r1", 5)
        platform.error = None
        await until(lambda: not platform.running)

    run(test)


def test_an_odd_answer_is_invalid(run: Callable[[Test], None]) -> None:
    async def test(agents: CloudAgents, platform: FakePlatform) -> None:
        platform.odd = True
        for call in (agents.start("hello", "1.0.0", "r1", 5), agents.address("r2", 5)):
            with pytest.raises(Invalid):
                await call

    run(test)


def test_files_among_the_arguments_are_sorted_out(tmp_path: Path) -> None:
    picture = tmp_path / "runs" / "r1" / "picture.jpg"
    picture.parent.mkdir(parents=True)
    picture.write_bytes(b"JPEG")
    given = {"picture": {"file": str(picture)}, "text": "x", "object": {"file": 3}, "more": {"file": "a", "b": 1}}
    plain, files = sorted_out(tmp_path, given)
    assert files == {"picture": picture}
    assert plain.keys() == {"text", "object", "more"}
    for path in ("/etc/passwd", str(tmp_path / "link" / "x"), "picture.jpg", str(tmp_path / "nothing")):
        with pytest.raises(Refused):
            sorted_out(tmp_path, {"picture": {"file": path}})
