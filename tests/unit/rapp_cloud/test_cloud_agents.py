"""Which cloud agents run for whom, with an engine in memory."""

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import manifest
from rapp_cloud.cloud_agents import agents as agents_module
from rapp_cloud.cloud_agents.agents import CALLS, CloudAgents, Quota
from rapp_cloud.cloud_agents.port import Order
from rapp_hop import strict_json
from rapp_hop.errors import Bug, HopError, Refused, Unreachable
from rapp_hop.hz.manifest import Manifest, parse_manifest
from rapp_hop.protocol import WireAnswer, WireRequest

ASKED = WireRequest("POST", "/hop/agents/x/look", {}, b"{}")


class FakeAgent:
    """Answers with the path; `problem` is what a test says; calls wait while `held`."""

    def __init__(self, order: Order) -> None:
        self.order = order
        self.problem = ""
        self.stopped = 0
        self.held = asyncio.Event()
        self.held.set()

    async def send(self, request: WireRequest, path: str, timeout: float) -> WireAnswer:
        await self.held.wait()
        return WireAnswer(200, "text/plain", path.encode())

    async def stop(self) -> None:
        await asyncio.sleep(0)
        self.stopped += 1


class FakeEngine:
    """Implements `CloudAgentEngine`; starting waits while `held`, and fails with `error`."""

    def __init__(self) -> None:
        self.agents: list[FakeAgent] = []
        self.prepared = 0
        self.closed = False
        self.error: HopError | None = None
        self.held = asyncio.Event()
        self.held.set()

    async def open(self) -> None:
        self.closed = False

    async def prepare(self) -> None:
        self.prepared += 1

    async def start(self, order: Order) -> FakeAgent:
        await self.held.wait()
        if self.error is not None:
            raise self.error
        self.agents.append(FakeAgent(order))
        return self.agents[-1]

    async def check(self) -> None:
        await asyncio.sleep(0)

    async def close(self) -> None:
        self.closed = True


class FakePackages:
    """Implements `Packages`: one cloud agent, which may call `cloud`."""

    def __init__(self) -> None:
        self.cloud = ["profile"]

    def open(self) -> None: ...

    def any(self) -> bool:
        return True

    def find(self, rapp: str, version: str) -> tuple[Manifest, Path]:
        if rapp != "hello":
            raise Refused(f"cannot start a cloud agent for {rapp}")
        fields = {"agent": "cloud", "keywords": {}, "sentences": {}, "permissions": {"cloud": self.cloud}}
        return parse_manifest(strict_json.dumps(manifest("hello_cloud", version, **fields)).encode()), Path("/nowhere")


class House:
    """The table of agents, and all that it needs; robots are here unless they are `away`."""

    def __init__(self) -> None:
        self.engine, self.packages, self.away = FakeEngine(), FakePackages(), set[str]()
        self.agents = CloudAgents(
            self.engine, self.packages, lambda robot: robot not in self.away, Quota(2, 3)  # type: ignore[arg-type]
        )  # fmt: skip

    async def start(self, run: str = "r1", robot: str = "nao", rapp: str = "hello") -> str:
        return await self.agents.start(robot, rapp, "1.0.0", run)


Test = Callable[[House], Coroutine[Any, Any, None]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[[Test], None]:
    monkeypatch.setattr(agents_module, "LOOK", 0.01)

    def run(test: Test) -> None:
        async def main() -> None:
            house = House()
            await house.agents.open()
            try:
                await asyncio.wait_for(test(house), 20)
            finally:
                await house.agents.close()
            assert house.engine.closed

        asyncio.run(main())

    return run


async def until(done: Callable[[], bool]) -> None:
    while not done():
        await asyncio.sleep(0.01)


def test_the_order_says_all_that_an_engine_needs(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        agent = await house.start()
        (started,) = house.engine.agents
        order = started.order
        assert (order.robot, order.run, order.name, order.entry) == ("nao", "r1", "hello_cloud", "agent.py")
        assert order.services == {"profile"}
        answer = await house.agents.send("nao", agent, ASKED, "/hop/look", 5)
        assert answer.body == b"/hop/look"
        assert house.engine.prepared == 2, "at the opening and after the start"

    run(test)


def test_one_run_has_one_agent_also_when_it_is_asked_for_twice_at_once(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        house.engine.held.clear()
        both = [asyncio.create_task(house.start()) for _ in range(2)]
        await asyncio.sleep(0.02)
        house.engine.held.set()
        first, second = await asyncio.gather(*both)
        assert first == second == await house.start()
        assert len(house.engine.agents) == 1

    run(test)


def test_a_caller_who_gives_up_does_not_lose_the_agent(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        house.engine.held.clear()
        impatient = asyncio.create_task(house.start())
        await asyncio.sleep(0.02)
        impatient.cancel()
        await asyncio.gather(impatient, return_exceptions=True)
        house.engine.held.set()
        await until(lambda: bool(house.agents.list("nao")))
        assert await house.start() == house.agents.list("nao")[0]["agent"]

    run(test)


def test_c02_quotas_count_what_is_being_started(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        house.engine.held.clear()
        starting = [asyncio.create_task(house.start(f"r{number}")) for number in range(2)]
        await asyncio.sleep(0.02)
        with pytest.raises(Refused, match="it has 2 already"):
            await house.start("r3")
        starting.append(asyncio.create_task(house.start("r1", "other")))
        await asyncio.sleep(0.02)
        with pytest.raises(Unreachable, match="runs 3 already"):
            await house.start("r1", "third")
        house.engine.held.set()
        first, *_ = await asyncio.gather(*starting)
        assert await house.agents.stop("nao", first)
        await house.start("r3")

    run(test)


def test_c03_agents_are_their_robot_s(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        agent = await house.start()
        for name in (agent, "nothing"):
            with pytest.raises(Refused, match="none of that name") as caught:
                await house.agents.send("other", name, ASKED, "/hop/look", 5)
            assert caught.value.status == 404
        assert not await house.agents.stop("other", agent)
        assert house.agents.list("other") == []
        assert house.engine.agents[0].stopped == 0

    run(test)


def test_c05_the_agents_of_a_silent_robot_go(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        agent, _ = await house.start(), await house.start("r1", "other")
        house.away.add("nao")
        await until(lambda: not house.agents.list("nao"))
        assert [each.stopped for each in house.engine.agents] == [1, 0]
        with pytest.raises(Refused, match="its robot is silent"):
            await house.agents.send("nao", agent, ASKED, "/hop/look", 5)

    run(test)


def test_an_agent_with_a_problem_goes_and_who_calls_later_is_told_which(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        agent = await house.start()
        house.engine.agents[0].problem = "it hangs"
        await until(lambda: not house.agents.list("nao"))
        with pytest.raises(Refused, match="it has ended, it hangs"):
            await house.agents.send("nao", agent, ASKED, "/hop/look", 5)
        assert await house.start() != agent

    run(test)


def test_l13_a_start_that_always_fails_is_told_each_time_and_takes_no_place(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        house.engine.error = Bug("cannot start hello_cloud: SyntaxError")
        for number in range(20):
            with pytest.raises(Bug, match="SyntaxError"):
                await house.start(f"r{number}")
        house.engine.error = None
        await house.start()

    run(test)


def test_an_agent_takes_so_many_calls_at_a_time(run: Callable[[Test], None]) -> None:
    async def test(house: House) -> None:
        agent = await house.start()
        house.engine.agents[0].held.clear()
        calls = [asyncio.create_task(house.agents.send("nao", agent, ASKED, "/hop/look", 5)) for _ in range(CALLS)]
        await asyncio.sleep(0.02)
        with pytest.raises(Unreachable, match="calls are open"):
            await house.agents.send("nao", agent, ASKED, "/hop/look", 5)
        house.engine.agents[0].held.set()
        await asyncio.gather(*calls)
        await house.agents.send("nao", agent, ASKED, "/hop/look", 5)

    run(test)


@pytest.mark.parametrize("service", sorted(agents_module.FORBIDDEN))
def test_what_only_the_robot_may_say_no_agent_may(run: Callable[[Test], None], service: str) -> None:
    async def test(house: House) -> None:
        house.packages.cloud = ["profile", service]
        with pytest.raises(Refused, match=f"no cloud agent may call {service}"):
            await house.start()
        assert house.engine.agents == []

    run(test)
