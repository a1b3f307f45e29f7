"""Lives of RApps that go wrong, of three and four agents, and what happens to a running RApp: the L items of the list of faults."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from fakes.rapps import write_four_agent_rapp, write_rapp
from fakes.whole_robot import WholeRobot, entered, listening_after, whole_robot
from rapp_hop.hz.install import RappFolder

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

SETTINGS = "hang = 3.0\nfirst_word = 4.0\ndismantle = 2.0\nterminate = 1.0\n"
PERMISSIONS = {"core": ["rapp_say"], "cloud": []}
SERVICE = "from rapp_hop.cloud_agent import service\n\n\n@service\ndef quick() -> str:\n    return 'quick'\n"
EXIT = "import os, signal\n"
CRASHES = {"exits": "os._exit(0)", "breaks": "os.kill(os.getpid(), signal.SIGSEGV)"}
STATES = {  # of a dynamic agent (paper Fig. 3); the robot's words when its process ends there
    "s1": "It did not start",
    "s2": "It has crashed",
    "s3": "It has crashed",
    "s4": "It has crashed",
    "s5": "",
}
METHODS = {"s1": "__init__(self, parameters=None)", "s2": "initialise(self)", "s3": "execute(self)", "s4": "terminate(self)"}
METHODS["s5"] = "dismantle(self)"  # after "terminate" was sent


def crashing(folder: Path, state: str, how: str) -> Path:
    """A RApp whose process ends in that state."""
    package = write_rapp(folder / f"{how}_{state}", f"{how}_{state}", "pass", (f"{how} {state}",), permissions=PERMISSIONS)
    lines = ["from rapp_api import DynamicAgent", f"{EXIT}", "class Agent(DynamicAgent):"]
    lines += [f"    def {METHODS[state]}:", f"        {CRASHES[how]}"]
    (package / "agent.py").write_text("\n".join(lines) + "\n")
    return package


def rapps(folder: Path) -> list[Path]:
    made = [crashing(folder, state, how) for state in STATES for how in CRASHES]
    silent = write_rapp(folder / "silent", "silent", "pass", permissions=PERMISSIONS)
    (silent / "agent.py").write_text("import time\ntime.sleep(1000)\n" + (silent / "agent.py").read_text())
    fine = write_rapp(folder / "fine", "fine", "communication.rapp_say('fine')", permissions=PERMISSIONS)
    lazy = "communication.rapp_say('here')\nself.pause(1.5)\nfrom pathlib import Path\n"
    lazy += "communication.rapp_say(Path('/rapp/package/note.txt').read_text())"
    reader = write_rapp(folder / "reader", "reader", lazy, permissions=PERMISSIONS)
    (reader / "note.txt").write_text("first")
    quits = "communication.rapp_say('here')\ncloud.call_agent_wait('quick')\n"
    stubborn = "import signal\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\nsignal.signal = lambda *_: None\n" + SERVICE
    made += write_four_agent_rapp(folder, "stays", quits, stubborn, permissions=PERMISSIONS)
    made += write_four_agent_rapp(folder, "leaves", f"{quits}import os\nos._exit(0)", SERVICE, permissions=PERMISSIONS)
    dies = SERVICE + "\n\n@service\ndef die() -> str:\n    import os\n    os._exit(0)\n"
    alone = (
        "for name in ('die', 'quick'):\n    try:\n        cloud.call_agent_wait(name)\n"
        "    except RappError as error:\n        communication.rapp_say(type(error).__name__)\n    self.pause(1)"
    )
    orphan = write_four_agent_rapp(folder, "orphan", alone, dies, permissions=PERMISSIONS)
    agent = orphan[1] / "agent.py"
    agent.write_text(agent.read_text().replace("import DynamicAgent,", "import DynamicAgent, RappError,"))
    slow = write_rapp(folder / "slow", "slow", "self.pause(0.5)", permissions=PERMISSIONS)
    agent = slow / "agent.py"
    agent.write_text(
        "import time\ntime.sleep(1)\n" + agent.read_text() + "\n    def dismantle(self) -> None:\n        self.pause(1)\n"
    )
    return [*made, silent, fine, reader, *orphan, slow]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WholeRobot]:
    folder = tmp_path_factory.mktemp("lives")
    robot = WholeRobot(folder / "robot", rapps(folder / "rapps"))
    robot.settings = SETTINGS
    with whole_robot(robot, "roscore", "cloud", "nao_sim", "rosbridge", "link", "core_agent"):
        yield robot


def run(robot: WholeRobot, keyword: str) -> list[str]:
    """Ask for a RApp; gives what the robot says until it listens again, when nothing of the run is left."""
    since = len(robot.seen)
    robot.ask(keyword)
    robot.until(listening_after(robot.until(entered("s7"), since)), since)
    robot.until_only_the_spare_runs()
    robot.until_only_the_cloud_spare_runs()
    return robot.said(since)


def test_l01_a_rapp_that_never_says_its_first_word_is_given_up(robot: WholeRobot) -> None:
    assert run(robot, "silent") == ["It did not start"]


@pytest.mark.parametrize("how", CRASHES)
@pytest.mark.parametrize("state", STATES)
def test_l02_l03_a_rapp_that_ends_in_any_of_its_states_is_gone(robot: WholeRobot, state: str, how: str) -> None:
    said = run(robot, f"{how} {state}")
    assert said == ([STATES[state]] if STATES[state] else []), robot.story()


def test_l06_a_finished_rapp_takes_its_cloud_agent_with_it_whatever_that_does(robot: WholeRobot) -> None:
    assert run(robot, "stays") == ["here"]


def test_l06_a_rapp_that_leaves_without_a_word_takes_its_cloud_agent_with_it(robot: WholeRobot) -> None:
    assert run(robot, "leaves") == ["here", "It has crashed"]


def test_l06_a_rapp_whose_cloud_agent_has_ended_is_told_and_ends(robot: WholeRobot) -> None:
    """In the middle of the call: unreachable; later, when it is known to have ended: refused."""
    assert run(robot, "orphan") == ["Unreachable", "Refused"]


@pytest.mark.parametrize("state", ["s8", "s9", "s10"])
def test_l09_a_second_command_while_a_rapp_starts_runs_or_stops_starts_nothing(robot: WholeRobot, state: str) -> None:
    since = len(robot.seen)
    robot.ask("slow")
    robot.until(entered(state), since)
    robot.say("fine")
    listening = robot.until(listening_after(robot.until(entered("s10"), since)), since)
    begun = [seen for seen in robot.seen[since:] if entered("s7")(seen) and seen.time < listening.time]
    assert len(begun) == 1
    assert "fine" not in robot.said(since)
    assert run(robot, "fine") == ["fine"]


def test_l10_a_rapp_removed_while_it_runs_comes_to_its_end(robot: WholeRobot) -> None:
    since = len(robot.seen)
    robot.ask("reader")
    robot.until(lambda seen: seen.detail == "here", since)
    assert RappFolder(robot.home / "rapps").remove("reader")
    robot.until(listening_after(robot.until(entered("s10"), since)), since)
    assert robot.said(since) == ["here", "first"]
    assert run(robot, "reader") == ["here", "first"]


def test_l10_a_rapp_updated_while_it_runs_is_new_in_its_next_run(robot: WholeRobot) -> None:
    run(robot, "reader")
    since = len(robot.seen)
    robot.ask("reader")
    robot.until(lambda seen: seen.detail == "here", since)
    folder = robot.home / "rapps" / "reader"
    shutil.copytree(folder / "1.0.0", folder / "1.0.1")
    (folder / "1.0.1" / "note.txt").write_text("second")
    manifest = folder / "1.0.1" / "package.json"
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "version": "1.0.1"}))
    (folder / "new").symlink_to("1.0.1")
    (folder / "new").rename(folder / "current")
    robot.until(listening_after(robot.until(entered("s10"), since)), since)
    assert robot.said(since) == ["here", "first"]
    robot.stop("link")  # so that the older version of the store is not fetched again
    assert run(robot, "reader") == ["here", "second"]
    robot.start("link")
