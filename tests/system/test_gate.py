"""What a RApp tries from inside on a whole robot, and what becomes of a run whose gate dies or stands still (DESIGN 3.1, 3.6)."""

import json
import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fakes.rapps import install_rapp
from fakes.whole_robot import WholeRobot, entered, listening_after, whole_robot
from rapp_ros.master import ask

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

PERMISSIONS = {"core": ["rapp_say"], "cloud": []}
ATTEMPTS = """
import json, os, socket, xmlrpc.client
from rapp_api import cloud, navigation
def attempt(function, *args):
    try:
        return [type(function(*args)).__name__, ""]
    except Exception as error:
        return [type(error).__name__, str(error)]
"""
SPY = (
    ATTEMPTS
    + """
facts = {name: attempt(socket.create_connection, ("127.0.0.1", port), 2) for name, port in PORTS.items()}
facts["internet"] = attempt(socket.create_connection, ("1.1.1.1", 443), 2)
facts["core"] = attempt(communication.rapp_record, 1.0)
facts["motion"] = attempt(navigation.move_to, 1.0, 0.0, 0.0)
facts["cloud"] = attempt(cloud.call_wait, "profile", {})
facts["mail"] = attempt(cloud.send_mail_wait, ["a@b.example"], "s", "b")
master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
facts["shut down"] = master.shutdown("/rosbridge", "please")
facts["foreign name"] = master.registerPublisher("/core_agent", "/core_agent/state", "*", "http://127.0.0.1:4000/")
facts["unregister"] = master.unregisterService("/core_agent", "/rapp_say", "rosrpc://127.0.0.1:4000")
facts["parameter"] = master.setParam("/core_agent", "/use_sim_time", True)
facts["files"] = [place for place in PLACES if os.path.exists(place)]
facts["processes"] = len([each for each in os.listdir("/proc") if each.isdigit()])
facts["left"] = sorted(os.listdir("/rapp/private"))
facts["secrets"] = sorted(name for name in os.environ if "TOKEN" in name or "SMTP" in name or "PASS" in name)
open("/rapp/private/of_an_earlier_run", "w").close()
open("/rapp/private/ended", "w").close()
print("FACTS " + json.dumps(facts), flush=True)
communication.rapp_say("here")
"""
)
NETWORK = ("naoqi", "rosbridge", "master", "internet")
REFUSED = {
    "core": "cannot call /rapp_record: the RApp's package.json does not name it under permissions.core",
    "motion": "cannot call /rapp_move_to: the RApp's package.json does not name it under permissions.core",
    "cloud": "cannot call profile: the RApp's package.json does not name it under permissions.cloud",
    "mail": "cannot call send_mail: the RApp's package.json does not name it under permissions.cloud",
}
IDLE = "communication.rapp_say('here')\nwhile True: self.pause(0.2)"
CALLING = "communication.rapp_say('here')\nwhile True: communication.rapp_say('again')"
ENDING = "self.dismantle = lambda: self.pause(1.0)\ncommunication.rapp_say('here')"
STATES = {"idle": IDLE, "calling": CALLING, "ending": ENDING}
FAULTS = {"killed": signal.SIGKILL, "frozen": signal.SIGSTOP}
SAID = {
    "killed": ["It has crashed", "It has failed"],  # whichever is seen first: the reply to its call is lost too
    "frozen": ["It does not answer any more"],
}

took: dict[tuple[str, str], float] = {}


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WholeRobot]:
    robot = WholeRobot(tmp_path_factory.mktemp("gate"))
    robot.settings = "dismantle = 2.0\nterminate = 1.0\n"
    ports = {"naoqi": robot._ports["nao_sim"], "rosbridge": robot._ports["rosbridge"], "master": robot._ports["roscore"]}
    places = [
        str(robot.data),
        str(robot.home / "rapps"),
        str(robot.home / "logs"),
        str(Path(__file__)),
        "/root",
        "/home",
        "/var/log",
    ]
    install_rapp(robot.home, "spy", f"PORTS, PLACES = {ports!r}, {places!r}\n{SPY.strip()}", permissions=PERMISSIONS)
    for name, body in STATES.items():
        install_rapp(robot.home, name, body, permissions=PERMISSIONS)
    with whole_robot(robot, "roscore", "cloud", "nao_sim", "rosbridge", "link", "core_agent"):
        yield robot
    print(f"\n{'gate':10}{'RApp':10}{'s until listening':>20}")
    for (fault, state), seconds in took.items():
        print(f"{fault:10}{state:10}{seconds:20.2f}")


def graph(robot: WholeRobot) -> Any:
    return ask(robot.ros["ROS_MASTER_URI"], 5.0, "getSystemState", "/test")[2]


def spied(robot: WholeRobot) -> dict[str, Any]:
    """Have the spy run to its end; gives what it found."""
    since = len(robot.seen)
    robot.ask("spy")
    here = robot.until(lambda seen: seen.kind == "said" and seen.detail == "here", since)
    robot.until(listening_after(here), since)
    found = re.search(r"^FACTS (.*)$", (robot.home / "logs" / "rapp-spy.log").read_text(), re.MULTILINE)
    assert found, robot.story(since)
    facts: dict[str, Any] = json.loads(found[1])
    return facts


def test_a_rapp_reaches_nothing_but_what_its_package_names_and_runs_in_a_row_do_not_see_each_other(robot: WholeRobot) -> None:
    before = graph(robot)
    first, second = spied(robot), spied(robot)
    for facts in (first, second):
        assert {facts[name][0] for name in NETWORK} <= {"ConnectionRefusedError", "OSError"}, facts
        assert {name: facts[name] for name in REFUSED} == {name: ["Refused", text] for name, text in REFUSED.items()}
        assert [facts[name][0] for name in ("shut down", "foreign name", "parameter")] == [-1, -1, -1]
        assert facts["files"] == facts["secrets"] == []
        assert facts["processes"] <= 3
        assert "of_an_earlier_run" not in facts["left"]
    assert graph(robot) == before
    assert ask(robot.ros["ROS_MASTER_URI"], 5.0, "getParam", "/test", "/use_sim_time")[0] != 1
    robot.until_only_the_spare_runs()


def gate_of_the_run(robot: WholeRobot) -> int:
    """Process id of the gate of the RApp that runs now: the spare's package folder is empty."""
    run = next(folder for folder in (robot.home / "runs").iterdir() if (folder / "package" / "agent.py").exists())
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        words = path.read_bytes().split(b"\0")
        if b"rapp_core.gate" in words and f"/dynamic_agent_{run.name}".encode() in words:
            return int(path.parent.name)
    raise AssertionError("the run has no gate")


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_run_whose_gate_fails_is_dismantled_and_the_robot_listens_again(robot: WholeRobot, fault: str, state: str) -> None:
    since, before = len(robot.seen), graph(robot)
    robot.ask(state)
    robot.until(lambda seen: seen.kind == "said" and seen.detail == "here", since)
    os.kill(gate_of_the_run(robot), FAULTS[fault])
    begun = time.monotonic()
    listening = robot.until(lambda seen: entered("s3")(seen) and seen.time > begun, since)
    took[fault, state] = listening.time - begun
    said = " ".join(robot.said(since))
    assert state == "ending" or any(words in said for words in SAID[fault]), robot.story(since)
    robot.until_only_the_spare_runs()
    assert graph(robot) == before


def test_the_next_rapp_runs_as_if_nothing_had_been(robot: WholeRobot) -> None:
    assert spied(robot)["core"][0] == "Refused"
