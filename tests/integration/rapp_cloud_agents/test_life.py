"""The life of a cloud agent's processes: warm, ready, crashed, frozen, stopped; nothing is left (C01, C04, L04)."""

import asyncio
import os
import signal
import time
from pathlib import Path

import pytest

from fakes.cloud_agents import PROBE, Workshop, call, in_workshop, until
from fakes.processes import ended
from fakes.whole_robot import processes_of
from rapp_cloud.cloud_agents.confined import Confined
from rapp_cloud.cloud_agents.orphans import clear
from rapp_cloud.cloud_agents.sandbox import Limits
from rapp_hop.errors import Bug, HopError, Refused, Unreachable

QUICK = Limits(start=6.0, silence=4.0, terminate=0.5, life=1000.0)


def nothing_runs(shop: Workshop) -> bool:
    """Neither a process nor a folder of an agent is left."""
    return not processes_of(shop.folder / "agents" / "runs") and not list((shop.folder / "agents" / "runs").iterdir())


def test_a_warm_spare_becomes_a_cloud_agent(tmp_path: Path) -> None:
    """The times are printed; aim: 100 ms from the order until it serves."""
    took: dict[str, list[float]] = {"cold": [], "warm": []}

    async def test(shop: Workshop) -> None:
        for kind in ("cold", "warm", "warm", "warm", "warm", "warm"):
            if kind == "warm":
                await shop.engine.prepare()
                assert shop.engine._spare is not None
                await shop.engine._spare
            begun = time.perf_counter()
            agent = await shop.start()
            took[kind].append(1000 * (time.perf_counter() - begun))
            assert (await call(agent, "ask", name="greet"))["caller"] == "nao"
            await agent.stop()
        assert nothing_runs(shop)

    in_workshop(tmp_path, test)
    for kind, times in took.items():
        print(f"\nms from the order until it serves, {kind}: {', '.join(f'{each:.1f}' for each in times)}", end="")
    print()


def test_a_sandbox_nobody_waits_for_any_more_leaves_nothing(tmp_path: Path) -> None:
    """bubblewrap's child waits for its parent before it is confined: killed alone, the parent would leave it behind."""
    slow, child = tmp_path / "slow", tmp_path / "child"
    slow.write_text(f"#!/bin/sh\nsleep 300 &\necho $! > {child}.new\nmv {child}.new {child}\nwait\n")
    slow.chmod(0o700)

    async def test() -> None:
        starting = asyncio.create_task(Confined.start([str(slow)], [], tmp_path / "log"))
        await until(child.exists)
        starting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await starting
        await until(lambda: ended(int(child.read_text())))

    asyncio.run(test())


def test_a_spare_that_died_is_not_used(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        await shop.engine.prepare()
        assert shop.engine._spare is not None
        spare = await shop.engine._spare
        os.kill(spare.process.first, signal.SIGKILL)
        await until(lambda: not spare.process.alive)
        agent = await shop.start()
        assert (await call(agent, "ask", name="greet"))["caller"] == "nao"
        await shop.engine.prepare()
        await shop.engine.close()
        assert nothing_runs(shop)

    in_workshop(tmp_path, test)


@pytest.mark.parametrize(
    ("program", "error", "words"),
    [
        ("x = = 1", Bug, "SyntaxError"),
        ("raise ValueError('on purpose')", Bug, "on purpose"),
        ("import sys; sys.exit(3)", Bug, "SystemExit"),
        ("import os; os._exit(3)", Bug, "cannot start probe"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", Bug, "cannot start probe"),
        ("x = 1", Bug, "no service"),
        ("import time; time.sleep(1000)", Unreachable, "not ready within"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGSTOP)", Unreachable, "not ready within"),
    ],
)
def test_c01_c04_an_agent_that_does_not_come_to_serve_is_reaped(
    tmp_path: Path, program: str, error: type[HopError], words: str
) -> None:
    async def test(shop: Workshop) -> None:
        with pytest.raises(error, match=words):
            await shop.start(program)
        assert nothing_runs(shop)

    in_workshop(tmp_path, test, QUICK)


@pytest.mark.parametrize("code", ["os._exit(3)", "os.kill(os.getpid(), signal.SIGSEGV)", "time.sleep(60)"])
def test_c01_a_crash_in_the_middle_of_a_call_ends_the_call(tmp_path: Path, code: str) -> None:
    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        running = asyncio.create_task(call(agent, "run", code=f"Path('begun').touch()\n{code}"))
        if "sleep" in code:
            await until(lambda: Path(f"/proc/{agent.process.first}/root/rapp/private/begun").exists())
            os.kill(agent.process.first, signal.SIGKILL)
        with pytest.raises(Unreachable, match="crashed"):
            await running
        assert agent.problem == "it has crashed"
        with pytest.raises(Unreachable, match="crashed"):
            await call(agent, "run", code="facts = 1")
        await agent.stop()
        assert nothing_runs(shop)

    in_workshop(tmp_path, test)


@pytest.mark.parametrize("code", ["time.sleep(1000)", "os.kill(os.getpid(), signal.SIGSTOP)"], ids=["loop hangs", "frozen"])
def test_an_agent_that_stands_still_is_seen_and_ended(tmp_path: Path, code: str) -> None:
    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        running = asyncio.create_task(call(agent, "run_in_loop", code=code))
        await until(lambda: agent.problem == "it hangs")
        await agent.stop()
        with pytest.raises(Unreachable):
            await running
        assert nothing_runs(shop)

    in_workshop(tmp_path, test, QUICK)


STUBBORN = """
for number in (signal.SIGTERM, signal.SIGINT):
    signal.signal(number, signal.SIG_IGN)
asyncio.get_running_loop().remove_signal_handler(signal.SIGTERM)
signal.signal(signal.SIGTERM, signal.SIG_IGN)
for _ in range(3):
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            time.sleep(1000)
        os._exit(0)
"""


def test_l04_an_agent_that_ignores_its_end_and_hides_children_is_gone(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        await call(agent, "run_in_loop", code=STUBBORN)
        await agent.stop()
        assert nothing_runs(shop)

    in_workshop(tmp_path, test, QUICK)


def test_an_orderly_agent_is_told_and_ends_by_itself(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        await asyncio.gather(agent.stop(), agent.stop())
        assert agent.process._process.returncode == 0  # not killed
        await agent.stop()

    in_workshop(tmp_path, test, Limits(terminate=60.0))


def test_an_agent_whose_time_is_over_is_told_so(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        await until(lambda: agent.problem == "its time is over")

    in_workshop(tmp_path, test, Limits(life=0.5))


@pytest.mark.parametrize(
    "said",
    ["b'{}\\n' + b'x' * 200_000", 'b\'{"type": "of its own"}\\n\'', 'b\'{"type": "alive"}\\n\' * 1000'],
    ids=["no message", "unknown type", "too many"],
)
def test_an_agent_that_sends_what_is_no_message_is_ended(tmp_path: Path, said: str) -> None:
    code = f"facts = os.write(int(os.environ['RAPP_AGENT_CHANNEL']), {said}); time.sleep(60)"

    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        running = asyncio.create_task(call(agent, "run", code=code))
        await until(lambda: agent.problem.startswith("its channel"))
        await agent.stop()
        await asyncio.gather(running, return_exceptions=True)

    in_workshop(tmp_path, test)


def test_a_folder_that_another_platform_uses_is_refused(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        other = type(shop.engine)(tmp_path / "agents", shop.doors.open)
        with pytest.raises(Refused, match="another platform"):
            await other.open()

    in_workshop(tmp_path, test)


def test_l12_only_what_an_earlier_platform_started_is_killed(tmp_path: Path) -> None:
    """Neither by a process id, which may be somebody else's by now, nor by the name of a program."""

    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        runs = tmp_path / "agents" / "runs"
        words = ["bash", "-c", "exec -a bwrap sleep 1000", f"{tmp_path}/elsewhere/package", f"--title={runs}/x"]
        other = await asyncio.create_subprocess_exec(*words)
        await asyncio.to_thread(clear, runs, "other-name")
        assert agent.problem == "" and list(runs.iterdir())
        await asyncio.to_thread(clear, runs)
        await until(lambda: not agent.process.alive)
        assert other.returncode is None
        other.kill()
        await other.wait()

    in_workshop(tmp_path, test)


def descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def test_many_starts_and_ends_leave_no_descriptor(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        await agent.stop()
        await asyncio.sleep(0)
        before = descriptors()
        for _ in range(5):
            agents = await asyncio.gather(*(shop.start(PROBE) for _ in range(2)))
            await asyncio.gather(*(each.stop() for each in agents))
        await until(lambda: descriptors() <= before)
        assert nothing_runs(shop)

    in_workshop(tmp_path, test)
