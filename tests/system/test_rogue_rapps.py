"""RApps that crash, hang, flood, fork, fill their disk, ignore their end: each is gone, the robot listens again (DESIGN 3.1)."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from fakes.rapps import write_rapp
from fakes.whole_robot import WholeRobot, entered, listening_after, whole_robot

pytestmark = [pytest.mark.system, pytest.mark.timeout(400)]

SETTINGS = """
hang = 2.0
dismantle = 2.0
terminate = 1.0
[limits]
file_size = 4_000_000
private = 4_000_000
"""
BUSY = 5.0  # s beside the bound that a machine with other work may take
SPACE = 20_000_000  # bytes the robot's data folder may grow by one run: its log, its package


@dataclass(frozen=True)
class Rogue:
    """What it does once it has said "here", what the robot says of it, and within how many s of that it listens again."""

    body: str
    said: str
    bound: float
    runtime: str = "python3"

    @property
    def program(self) -> str:
        """What it executes, with the word before."""
        say = "communication.rapp_say('here')" if self.runtime == "python3" else "await communication.textToSpeech('here');"
        return f"{say}\n{self.body}"


CHANNEL = "import os, socket\nend = socket.socket(fileno=int(os.environ['RAPP_CHANNEL_FD']))\n"
ROGUES = {
    "exits": Rogue("import os\nos._exit(3)", "It has crashed", 2.0),
    "breaks": Rogue("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)", "It has crashed", 2.0),
    "kills all others": Rogue("import os, signal\nos.kill(-1, signal.SIGKILL)", "It has failed", 2.0),
    "raises": Rogue("raise ValueError('on purpose')", "It has failed", 2.0),
    "stands still": Rogue("import os, signal\nos.kill(os.getpid(), signal.SIGSTOP)", "It does not answer any more", 1.0 + 2.0),
    "sleeps": Rogue("import time\ntime.sleep(1000)", "It hangs", 2.0 + 2.0),
    "turns in circles": Rogue("while True: pass", "It hangs", 2.0 + 2.0),
    "sends an endless line": Rogue(CHANNEL + "while True: end.sendall(bytes(100_000))", "It has failed", 2.0),
    "sends what is no message": Rogue(CHANNEL + "end.sendall(b'hello\\n')\nself.pause(1000)", "It has failed", 2.0),
    "floods its channel": Rogue(
        CHANNEL + "line = b'{\"type\": \"state\", \"kind\": \"entered\", \"state\": \"x\", \"machine\": \"m\"}\\n' * 500\n"
        "while True: end.sendall(line)", "It hangs", 2.0 + 2.0,
    ),
    "floods the core agent": Rogue(
        "import threading\ndef ask():\n    while True:\n        try: communication.play_audio('nothing.ogg')\n"
        "        except Exception: pass\nfor _ in range(20): threading.Thread(target=ask, daemon=True).start()\n"
        "import time\ntime.sleep(1000)", "It hangs", 2.0 + 2.0,
    ),
    "prints for ever": Rogue("while True: print('x' * 100_000)", "It has failed", 4.0),
    "forks": Rogue("import os\nwhile True: os.fork()", "It has failed", 4.0),
    "hides a child": Rogue(
        "import os, time\nif os.fork() == 0:\n    os.setsid()\n    if os.fork() == 0: time.sleep(1000)\n    os._exit(0)", "", 2.0,
    ),
    "fills its disk": Rogue(
        "for number in range(10_000):\n    with open(f'file{number}', 'wb') as file: file.write(bytes(1_000_000))",
        "It has failed", 4.0,
    ),
    "fills the memory": Rogue(
        "kept = []\nwhile True:\n    kept.append(bytearray(50_000_000))\n    self.pause(0.01)", "It has failed", 4.0,
    ),
    "ignores its end": Rogue(
        "import signal, time, types\nfor number in (signal.SIGTERM, signal.SIGINT): signal.signal(number, signal.SIG_IGN)\n"
        "self.dismantle = lambda: time.sleep(1000)", "", 2.0 + 1.0 + 1.0,
    ),
    "exits from node": Rogue("process.exit(3);", "It has crashed", 2.0, "javascript"),
    "blocks its event loop": Rogue("while (true) {}", "It hangs", 2.0 + 2.0, "javascript"),
    "writes for ever": Rogue(
        "while (true) { console.log('x'.repeat(100_000)); await null; }", "It has crashed", 4.0, "javascript"
    ),
    "node ignores its end": Rogue(
        "process.on('SIGTERM', () => {}); this.dismantle = () => new Promise(() => {});", "", 2.0 + 1.0 + 1.0, "javascript"
    ),
}  # fmt: skip
PERMISSIONS = {"core": ["rapp_say", "rapp_play_audio"], "cloud": []}


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WholeRobot]:
    folder = tmp_path_factory.mktemp("rogues")
    packages = [
        write_rapp(folder / "rapps" / name, name.replace(" ", "_"), rogue.program, (name,),
                   permissions=PERMISSIONS, runtime=rogue.runtime)
        for name, rogue in ROGUES.items()
    ]  # fmt: skip
    robot = WholeRobot(folder / "robot", packages)
    robot.settings = SETTINGS
    with whole_robot(robot, "roscore", "cloud", "nao_sim", "rosbridge", "link", "core_agent"):
        yield robot
    print(f"\n{'RApp':28}{'s until listening':>20}{'bound':>8}")
    for name, rogue in ROGUES.items():
        print(f"{name:28}{took.get(name, float('nan')):20.2f}{rogue.bound:8.1f}")


took: dict[str, float] = {}


def size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink())


@pytest.mark.parametrize("name", ROGUES)
def test_l04_l05_it_is_gone_and_the_robot_listens_again(robot: WholeRobot, name: str) -> None:
    rogue, since, before = ROGUES[name], len(robot.seen), size(robot.home)
    robot.ask(name)
    here = robot.until(lambda seen: seen.kind == "said" and seen.detail == "here", since)
    listening = robot.until(listening_after(here), since)
    took[name] = listening.time - here.time
    assert took[name] <= rogue.bound + BUSY, robot.story(since)
    assert rogue.said in " ".join(robot.said(since)), robot.story(since)
    robot.until_only_the_spare_runs()
    assert size(robot.home) - before < SPACE
    destroyed = robot.until(lambda seen: seen.detail == "core: dynamic agent destroyed", since)
    assert destroyed.time <= listening.time


def test_the_next_rapp_runs_as_if_nothing_had_been(robot: WholeRobot) -> None:
    since = len(robot.seen)
    robot.ask("raises")
    robot.until(entered("s10"), since)
    assert robot.said(since)[0] == "here"
