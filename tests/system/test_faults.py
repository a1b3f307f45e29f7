"""Processes of the robot are killed or frozen, and brought back, in every state of the core FSM: it listens again each time.

One table, states x faults, printed at the end.
"""

import shutil
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from fakes.fault_table import Cell, Cells, FaultTable, listened_before, serve
from fakes.rapps import write_rapp
from fakes.whole_robot import WholeRobot, entered

pytestmark = [pytest.mark.system, pytest.mark.timeout(900)]

AWAY = 1.5  # s a process is away: longer than the link may be silent, and than a lease without heartbeat
BOUND = 10.0  # s to listen again once it is back: a call of NAOqi that hangs, and saying what failed
BUSY = 10.0  # s beside it that a machine with two tables at work may take
FAULTS = [(name, how) for name in ("nao_sim", "rosbridge", "link", "roscore", "core_agent") for how in ("killed", "frozen")]

ENTRY = {
    "lazy": "communication.rapp_say('here')\nself.pause(3)",
    "recorder": "communication.rapp_record(3.0)",
    "caller": "cloud.call_wait('profile')",
    "crasher": "raise ValueError('on purpose')",
    "fine": "communication.rapp_say('fine')",
}
PERMISSIONS = {"core": ["rapp_say", "rapp_record"], "cloud": ["profile"]}
TWINS = {"castor": "please start one of the twins", "pollux": "start one of the twins please"}
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
    robot.room("personSay", TWINS["castor"], "en-us+m3")
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
    twins = [write_rapp(folder / name, name, "pass", sentences={"en": [sentence]}) for name, sentence in TWINS.items()]
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
    robot.until_only_the_spare_runs()
    listening = max(0.0, listened_before(robot, served).time - back)
    assert listening <= BOUND + BUSY, f"it listened again after {listening:.1f} s\n{robot.story()}"
    return Cell(listening, served.time - back)


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Cells:
    """All cases; printed at the end."""
    folder, cases = tmp_path_factory.mktemp("faults"), FaultTable(list(STATES), FAULTS, suffer)
    cells = cases.fill(folder, rapps(folder / "rapps"), at_once=len(FAULTS) // 2)
    cases.show(f"s until the robot listens again / serves a request again, after the process is back (bound {BOUND:g} s)", cells)
    return cells


def test_l07_a_core_agent_killed_in_every_state_comes_back_to_a_known_one_without_orphans(table: Cells) -> None:
    """That the robot is at rest then, is seen by `test_guard` and `test_motion_faults`."""
    assert {state: table[state, "core_agent", "killed"].problem for state in STATES} == dict.fromkeys(STATES, "")


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize(("name", "how"), FAULTS)
def test_the_robot_listens_again_and_nothing_is_left(table: Cells, state: str, name: str, how: str) -> None:
    assert not table[state, name, how].problem
