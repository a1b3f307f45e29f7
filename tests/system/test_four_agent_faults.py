"""Each process of a four-agent RApp is killed or frozen in each of its states: the robot listens again, and nothing is left running
anywhere, neither on the robot nor at the platform (deliverable section 3.2, DESIGN 3.1).

One table, states x faults, printed at the end; as in `test_faults`, which has the states of three agents.
"""

import os
import signal
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from fakes.rapps import write_four_agent_rapp, write_rapp
from fakes.whole_robot import PATIENCE, Seen, WholeRobot, entered, inside, listening_after, whole_robot

pytestmark = [pytest.mark.system, pytest.mark.timeout(900)]

AWAY = 1.5  # s a process is away
BOUND = 25.0  # s to listen again: a silent cloud agent is given up after 5 s, a call of the cloud after its own time
PROCESSES = ("rosbridge", "link", "cloud", "core_agent")  # started again by the test, as their supervisor does
AGENTS = {"a_cloud": "rapp_hop.cloud_agent_runner", "a_dyn": "rapp_api.runner"}  # gone for good
FAULTS = [(name, how) for name in (*AGENTS, *PROCESSES) for how in ("killed", "frozen")]

PROGRAM = """
import asyncio
from rapp_hop.cloud_agent import repository, service


@service
async def slow() -> str:
    await asyncio.sleep(2)
    return (await repository.call("profile"))["name"]


@service
async def quick() -> str:
    return "quick"
"""
CALL = "self.pause(0.1)\ncloud.call_agent_wait('quick')\n"
RAPPS = {  # the state: what the dynamic agent does, and what comes before the cloud agent's program
    "starting": ("self.pause(0.1)\ncloud.call_agent_wait('quick')", "import time\ntime.sleep(2)\n"),
    "calling": ("cloud.call_agent_wait('slow', timeout=10)", ""),
    "running": (f"{CALL}communication.rapp_say('here')\nself.pause(2.5)", ""),
    "ending": (f"{CALL}", ""),
}
SLOW_TO_END = "\n    def dismantle(self) -> None:\n        self.pause(1.5)\n"
REACHED = {
    "starting": "core->link start_cloud_agent starting",
    "calling": "link->cloud-agent slow",
    "running": "here",
    "ending": "core->dynamic dismantle (asynchronous)",
}
PERMISSIONS = {"core": ["rapp_say"], "cloud": []}


@dataclass(frozen=True)
class Cell:
    """How one case went: s from the end of the fault until s3, and until nothing was left; or what went wrong."""

    listening: float
    clean: float
    problem: str = ""


Table = dict[tuple[str, str, str], Cell]


def rapps(folder: Path) -> list[Path]:
    made = [write_rapp(folder / "fine", "fine", "communication.rapp_say('fine')", permissions=PERMISSIONS)]
    for state, (body, before) in RAPPS.items():
        made += write_four_agent_rapp(folder, state, body, before + PROGRAM, ("profile",), permissions=PERMISSIONS)
    agent = folder / "ending" / "dynamic" / "agent.py"
    agent.write_text(agent.read_text() + SLOW_TO_END)
    return made


def suffer(robot: WholeRobot, state: str, name: str, how: str) -> Cell:
    """One case: reach the state, strike, bring back, see that the robot listens and serves, and that nothing is left."""
    since = len(robot.seen)
    robot.ask(state)
    robot.until(lambda seen: seen.detail == REACHED[state], since)
    if name in AGENTS:
        strike(robot, name, how)
    else:
        robot.freeze(name) if how == "frozen" else robot.kill(name)
        time.sleep(AWAY)
        robot.thaw(name) if how == "frozen" else robot.start(name)
    back = time.monotonic()
    served = serve(robot)
    listened = next(seen for seen in reversed(robot.seen) if seen.time < served.time and entered("s3")(seen))
    assert listened.time - back < BOUND, f"it has listened again after {listened.time - back:.1f} s only"
    robot.until_only_the_spare_runs()
    robot.until_only_the_cloud_spare_runs()
    return Cell(max(0.0, listened.time - back), time.monotonic() - back)


def strike(robot: WholeRobot, name: str, how: str) -> None:
    runs = robot.home / "runs" if name == "a_dyn" else robot.data / "agents" / "runs"
    deadline = time.monotonic() + PATIENCE
    while (pid := inside(runs, AGENTS[name])) is None:  # it may be about to start
        assert time.monotonic() < deadline, f"there is no {name}"
        time.sleep(0.02)
    os.kill(pid, signal.SIGSTOP if how == "frozen" else signal.SIGKILL)


def serve(robot: WholeRobot) -> Seen:
    """Ask for a RApp until it was run to its end; gives when it spoke."""
    deadline = time.monotonic() + 2 * PATIENCE
    while True:
        since = len(robot.seen)
        with suppress(AssertionError):
            robot.ask("fine")
            spoken = robot.until(lambda seen: seen.kind == "said" and seen.detail == "fine", since, 5.0)
            robot.until(listening_after(spoken), since)
            return spoken
        assert time.monotonic() < deadline, f"it is not served again\n{robot.story(since)}"


def column(folder: Path, packages: list[Path], fault: tuple[str, str]) -> Table:
    """All states with one fault, on one robot; a case that fails gives the next one a new robot."""
    table: Table = {}
    states = list(RAPPS)
    while states:
        robot = WholeRobot(folder / f"robot-{len(states)}", packages)
        with whole_robot(robot, "roscore", "cloud", "nao_sim", "rosbridge", "link", "core_agent"):
            serve(robot)
            while states:
                state = states.pop(0)
                try:
                    table[(state, *fault)] = suffer(robot, state, *fault)
                except Exception as error:  # noqa: BLE001 - whatever it is, it is this cell's, and the table goes on
                    story = f"{type(error).__name__}: {error}\n{robot.story(max(0, len(robot.seen) - 80))}"
                    table[(state, *fault)] = Cell(0.0, 0.0, story[-12000:])
                    break
    return table


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Table]:
    """All cases; printed at the end."""
    folder = tmp_path_factory.mktemp("four")
    packages = rapps(folder / "rapps")
    cells: Table = {}
    with ThreadPoolExecutor(4) as pool:
        for part in pool.map(lambda fault: column(folder / "-".join(fault), packages, fault), FAULTS):
            cells |= part
    show(cells)
    yield cells


def show(cells: Table) -> None:
    print(f"\ns until the robot listens again (bound {BOUND:g} s) / nothing is left (bound {PATIENCE:g} s)")
    print(f"{'':9}" + "".join(f"{name + ' ' + how:>19}" for name, how in FAULTS))
    for state in RAPPS:
        row = [cells[(state, *fault)] for fault in FAULTS]
        texts = ["failed" if cell.problem else f"{cell.listening:.1f} / {cell.clean:.1f}" for cell in row]
        print(f"{state:9}" + "".join(f"{text:>19}" for text in texts))


@pytest.mark.parametrize("state", RAPPS)
@pytest.mark.parametrize(("name", "how"), FAULTS)
def test_the_robot_listens_again_and_nothing_is_left(table: Table, state: str, name: str, how: str) -> None:
    assert not table[state, name, how].problem
