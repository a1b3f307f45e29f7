"""Three agents and four agents (deliverable sections 3.1, 3.2): the whole way of their calls, and the order of their end."""

import json
import os
import select
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fakes.rapps import write_four_agent_rapp, write_rapp
from fakes.whole_robot import WholeRobot, entered, running_of, whole_robot

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

PROFILE = {"name": "Maria", "language": "en", "contacts": []}
THREE = """
profile = cloud.call_wait("profile")
communication.rapp_say("hello " + profile["name"])
"""
FOUR = """
from pathlib import Path
Path("picture.jpg").write_bytes(bytes(100_000))
recording = communication.rapp_record(0.3)
found = cloud.call_agent_wait("look", {"picture": Path("picture.jpg"), "recording": Path(recording), "words": ["a", "b"]})
communication.rapp_say(f"{found['name']} {found['picture']} {found['recording'] > 0} {found['words']}")
try:
    cloud.call_wait("profile")
except RappError as error:
    communication.rapp_say("the package does not name it")
answers = []
cloud.call_agent("slow", {"seconds": 0.5}, lambda result: answers.append(result))
assert cloud.call_agent_wait("quick") == "quick"
while not answers:
    self.pause(0.05)
communication.rapp_say(answers[0])
"""
LOOKER = """
import asyncio
from pathlib import Path
from rapp_hop.cloud_agent import repository, service


@service
async def look(picture: Path, recording: Path, words: list[str]) -> dict:
    profile = await repository.call("profile")
    return {"name": profile["name"], "picture": picture.stat().st_size, "recording": recording.stat().st_size, "words": len(words)}


@service
async def slow(seconds: float) -> str:
    await asyncio.sleep(seconds)
    return "slow"


@service
def quick() -> str:
    return "quick"
"""
WAITER = 'cloud.call_agent_wait("quick")\ncommunication.rapp_say("here")\nself.pause(1000)'


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WholeRobot]:
    folder = tmp_path_factory.mktemp("agents")
    core = {"core": ["rapp_say", "rapp_record"], "cloud": []}
    packages = [
        write_rapp(folder / "three", "three", THREE, permissions={**core, "cloud": ["profile"]}),
        *write_four_agent_rapp(folder, "four", FOUR, LOOKER, ("profile",), permissions=core),
        *write_four_agent_rapp(folder, "waiter", WAITER, LOOKER, permissions=core),
        *write_four_agent_rapp(folder, "broken", "self.pause(1000)", "raise ValueError('on purpose')", permissions=core),
    ]
    for package in packages:
        program = package / "agent.py"
        program.write_text(program.read_text().replace("import DynamicAgent,", "import DynamicAgent, RappError,"))
    robot = WholeRobot(folder / "robot", packages, PROFILE)
    with whole_robot(robot, "roscore", "cloud", "nao_sim", "rosbridge", "link", "core_agent"):
        yield robot


def served(robot: WholeRobot, keyword: str) -> tuple[list[str], list[str]]:
    """Ask for a RApp; gives what it says and all messages until the robot listens again."""
    since = len(robot.seen)
    robot.ask(keyword)
    robot.until(entered("s10"), since)
    robot.until_listening(next(i for i in range(since, len(robot.seen)) if entered("s10")(robot.seen[i])))
    return robot.said(since), robot.messages(since)


def in_order(messages: list[str], wanted: list[str]) -> bool:
    rest = iter(messages)
    return all(message in rest for message in wanted)


def test_three_agents_the_dynamic_agent_calls_the_repository_agent(robot: WholeRobot) -> None:
    said, messages = served(robot, "three")
    assert said == ["hello Maria"]
    assert in_order(messages, [
        "dynamic->core rapp_cloud_call", "core->link call profile", "link->repository profile", "repository->link reply profile",
        "link->core reply call profile", "core->dynamic reply rapp_cloud_call",
    ]), messages  # fmt: skip
    assert not [message for message in messages if "cloud_agent" in message or "cloud-agent" in message]


def test_four_agents_the_dynamic_agent_calls_its_cloud_agent_which_calls_the_repository_agent(robot: WholeRobot) -> None:
    said, messages = served(robot, "four")
    assert said == ["Maria 100000 True 2", "the package does not name it", "slow"]
    assert in_order(messages, [
        "core->link start_cloud_agent four", "link->repository start_cloud_agent", "repository->link reply start_cloud_agent",
        "link->core reply start_cloud_agent four",
        "dynamic->core rapp_cloud_call", "core->link call look", "link->cloud-agent look", "cloud-agent->link reply look",
        "link->core reply call look", "core->dynamic reply rapp_cloud_call",
        "dynamic->core terminate (asynchronous)", "core->dynamic dismantle (asynchronous)", "dynamic->core rapp_stop_cloud_agent",
        "core->link stop_cloud_agent", "link->repository stop_cloud_agent", "repository->link reply stop_cloud_agent",
        "link->core reply stop_cloud_agent", "core->dynamic reply rapp_stop_cloud_agent",
        "dynamic->core gone (asynchronous)", "core: dynamic agent destroyed",
    ]), messages  # fmt: skip
    nothing_is_left(robot)


def nothing_is_left(robot: WholeRobot) -> None:
    robot.until_only_the_spare_runs()
    robot.until_only_the_cloud_spare_runs()


def test_the_cloud_agent_s_process_is_gone_before_the_dynamic_agent_s(robot: WholeRobot) -> None:
    since = len(robot.seen)
    robot.ask("four")
    robot.until(lambda seen: seen.detail == "link->core reply start_cloud_agent four", since)
    ended: dict[str, float] = {}

    def wait(name: str, handle: int) -> None:
        if select.select([handle], [], [], 60.0)[0]:
            ended[name] = time.monotonic()
        os.close(handle)

    threads = [
        threading.Thread(target=wait, args=(name, os.pidfd_open(pid)))
        for name, pid in (("cloud", cloud_agent(robot)), ("dynamic", dynamic_agent(robot)))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(ended, key=ended.__getitem__) == ["cloud", "dynamic"], robot.story(since)
    robot.until_listening(next(i for i in range(since, len(robot.seen)) if entered("s10")(robot.seen[i])))


def cloud_agent(robot: WholeRobot) -> int:
    """Process id of bubblewrap around the cloud agent: the spare has no package yet."""
    (folder,) = [path.parent for path in (robot.data / "agents" / "runs").glob("*/package") if any(path.iterdir())]
    return min(pid for pid, words in running_of(folder).items() if words.startswith("bwrap"))


def dynamic_agent(robot: WholeRobot) -> int:
    """The same of the dynamic agent."""
    (pid,) = [path.parent for path in (robot.home / "runs").glob("*/package") if any(path.iterdir())]
    return int((pid / "pid").read_text().split()[0])


def test_a_cloud_agent_that_fails_at_its_start_fails_its_rapp_aloud(robot: WholeRobot) -> None:
    since = len(robot.seen)
    robot.ask("broken")
    robot.until(lambda seen: (seen.kind, seen.detail) == ("said", "I cannot start its part in the cloud"), since)
    robot.until_listening(next(i for i in range(since, len(robot.seen)) if entered("s11")(robot.seen[i])))
    nothing_is_left(robot)


def test_cloud_packages_are_neither_listed_nor_installed(robot: WholeRobot) -> None:
    served(robot, "three")
    installed = {path.name for path in (robot.home / "rapps").iterdir() if not path.name.startswith(".")}
    assert "three" in installed and not [name for name in installed if name.endswith("_cloud")]
    listed = {rapp["name"]: rapp for rapp in json.loads(Path(robot.home / "link" / "rapps.json").read_text())["rapps"]}
    assert set(listed) == {"three", "four", "waiter", "broken"}
