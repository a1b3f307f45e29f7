"""Processes of the robot are killed or frozen, and brought back, in every state of the core FSM: it listens again each time.

One table, states x faults, printed at the end. Each column has a robot of its own, so that columns run side by side.
"""

import shutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from fakes.rapps import write_rapp
from fakes.whole_robot import PATIENCE, Seen, WholeRobot, entered, listening_after, whole_robot

pytestmark = [pytest.mark.system, pytest.mark.timeout(900)]

AWAY = 1.5  # s a process is away: longer than the link may be silent, and than a lease without heartbeat
BOUND = 10.0  # s to listen again once it is back: a call of NAOqi that hangs, and saying what failed
FAULTS = [(name, how) for name in ("nao_sim", "rosbridge", "link", "roscore", "core_agent") for how in ("killed", "frozen")]

ENTRY = {
    "lazy": "communication.rapp_say('here')\nself.pause(3)",
    "recorder": "communication.rapp_record(3.0)",
    "caller": "cloud.call_wait('profile')",
    "crasher": "raise ValueError('on purpose')",
    "fine": "communication.rapp_say('fine')",
}
PERMISSIONS = {"core": ["rapp_say", "rapp_record"], "cloud": ["profile"]}
SLOW_TO_START = "import time\ntime.sleep(1.5)\n"
SLOW_TO_END = "\n    def dismantle(self) -> None:\n        self.pause(1.5)\n"

Reach = Callable[[WholeRobot], None]


def at(state: str, keyword: str, held: bool = False) -> Reach:
    """Reaches a state by asking for a RApp; `held`: the platform stands still, so that the state waits for it."""

    def reach(robot: WholeRobot) -> None:
        since = len(robot.seen)
        if held:
            robot.freeze("cloud")
        robot.ask(keyword)
        robot.until(entered(state), since)

    return reach


def in_service(keyword: str, sub_state: str) -> Reach:
    """Reaches a state of a core service, within s9."""

    def reach(robot: WholeRobot) -> None:
        since = len(robot.seen)
        robot.ask(keyword)
        robot.until(lambda seen: sub_state in (seen.state, seen.detail), since)

    return reach


def long_command(robot: WholeRobot) -> None:
    since = len(robot.seen)
    robot.freeze("cloud")
    robot.room("personSay", "would you be so kind and run the program that is fine", "en-us+m3")
    robot.until(entered("s5"), since)


def ambiguous_command(robot: WholeRobot) -> None:
    since = len(robot.seen)
    robot.room("personSay", "please start one of the twins", "en-us+m3")
    robot.until(entered("s12"), since)


def restarting(state: str, holder: str) -> Reach:
    """Reaches a state that comes once, by starting the core agent anew; `holder` stands still, so that the state waits for it."""

    def reach(robot: WholeRobot) -> None:
        robot.stop("core_agent")
        since = len(robot.seen)
        robot.freeze(holder)
        robot.start("core_agent")
        robot.until(lambda seen: seen.state == state, since)

    return reach


STATES: dict[str, Reach] = {
    "s1": restarting("s1", "nao_sim"),
    "s2": restarting("s2", "cloud"),
    "s3": lambda robot: None,
    "s4": at("s4", "lazy"),
    "s5": long_command,
    "s6": at("s6", "fresh", held=True),
    "s7": at("s7", "lazy"),
    "s8": at("s8", "slow to start"),
    "s9": at("s9", "lazy"),
    "s9 record": in_service("recorder", "core->ALAudioRecorder startMicrophonesRecording (asynchronous)"),
    "s9 cloud call": in_service("caller", "dynamic->core rapp_cloud_call"),
    "s10": at("s10", "slow to end"),
    "s11": at("s11", "crasher"),
    "s12": ambiguous_command,
}


@dataclass(frozen=True)
class Cell:
    """How one case went: s from the end of the fault until s3, and until a request was served; or what went wrong."""

    listening: float
    served: float
    problem: str = ""


Table = dict[tuple[str, str, str], Cell]


def rapps(folder: Path) -> list[Path]:
    """The RApps that lead the core agent into its states."""
    made = [write_rapp(folder / name, name, body, permissions=PERMISSIONS) for name, body in ENTRY.items()]
    fresh = write_rapp(folder / "fresh", "fresh", "pass")
    slow_to_start = write_rapp(folder / "slow", "slow_to_start", "pass", ("slow to start",))
    agent = slow_to_start / "agent.py"
    agent.write_text(SLOW_TO_START + agent.read_text())
    slow_to_end = write_rapp(folder / "end", "slow_to_end", "pass", ("slow to end",))
    agent = slow_to_end / "agent.py"
    agent.write_text(agent.read_text() + SLOW_TO_END)
    sentences = {"en": ["please start one of the twins"]}
    twins = [write_rapp(folder / name, name, "pass", sentences=sentences) for name in ("castor", "pollux")]
    return [*made, fresh, slow_to_start, slow_to_end, *twins]


def suffer(robot: WholeRobot, state: str, name: str, how: str) -> Cell:
    """One case: reach the state, strike, bring back, and see that the robot listens and serves again."""
    shutil.rmtree(robot.home / "rapps" / "fresh", ignore_errors=True)
    STATES[state](robot)
    robot.freeze(name) if how == "frozen" else robot.kill(name)
    time.sleep(AWAY)
    robot.thaw(name) if how == "frozen" else robot.start(name)
    back = time.monotonic()
    robot.thaw_all()
    served = serve(robot)
    listened = next(seen for seen in reversed(robot.seen) if seen.time < served.time and entered("s3")(seen))
    robot.until_only_the_spare_runs()
    return Cell(max(0.0, listened.time - back), served.time - back)


def serve(robot: WholeRobot) -> Seen:
    """Ask for a RApp until it was run to its end; gives when it spoke."""
    deadline = time.monotonic() + PATIENCE
    while True:
        since = len(robot.seen)
        robot.ask("fine")
        with suppress(AssertionError):
            spoken = robot.until(lambda seen: seen.kind == "said" and seen.detail == "fine", since, 5.0)
            robot.until(listening_after(spoken), since)
            return spoken
        assert time.monotonic() < deadline, f"it is not served again\n{robot.story(since)}"


def column(folder: Path, packages: list[Path], fault: tuple[str, str]) -> Table:
    """All states with one fault, on one robot; a case that fails gives the next one a new robot."""
    table: Table = {}
    states = list(STATES)
    while states:
        robot = WholeRobot(folder / f"robot-{len(states)}", packages)
        with whole_robot(robot):
            serve(robot)
            while states:
                state = states.pop(0)
                try:
                    table[(state, *fault)] = suffer(robot, state, *fault)
                except Exception as error:  # noqa: BLE001 - whatever it is, it is this cell's, and the table goes on
                    table[(state, *fault)] = Cell(0.0, 0.0, f"{type(error).__name__}: {error}"[-6000:])
                    break
    return table


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Table]:
    """All cases; printed at the end."""
    folder = tmp_path_factory.mktemp("faults")
    packages = rapps(folder / "rapps")
    cells: Table = {}
    with ThreadPoolExecutor(len(FAULTS) // 2) as pool:
        for part in pool.map(lambda fault: column(folder / " ".join(fault).replace(" ", "-"), packages, fault), FAULTS):
            cells |= part
    show(cells)
    yield cells


def show(cells: Table) -> None:
    print(f"\ns until the robot listens again / serves a request again, after the process is back (bound {BOUND:g} s)")
    print(f"{'':14}" + "".join(f"{name + ' ' + how:>19}" for name, how in FAULTS))
    for state in STATES:
        row = [cells[(state, *fault)] for fault in FAULTS]
        texts = ["failed" if cell.problem else f"{cell.listening:.1f} / {cell.served:.1f}" for cell in row]
        print(f"{state:14}" + "".join(f"{text:>19}" for text in texts))


def test_l07_a_core_agent_killed_in_every_state_comes_back_to_a_known_one_without_orphans(table: Table) -> None:
    """That the robot is at rest then, is seen by `test_guard` and `test_motion_faults`."""
    assert {state: table[state, "core_agent", "killed"].problem for state in STATES} == dict.fromkeys(STATES, "")


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize(("name", "how"), FAULTS)
def test_the_robot_listens_again_and_nothing_is_left(table: Table, state: str, name: str, how: str) -> None:
    assert not table[state, name, how].problem
