"""How long it takes from the end of speech to a RApp's first core service call, phase by phase.

    ./rapp bench activation [--rounds N]

Starts a whole robot and a platform as `./rapp demo` does, and asks for a RApp by an isolated keyword and by a whole sentence,
installed and fresh (never seen: neither the package nor the store's metadata). Medians; the phases are those of `phases.py`.
In the same run: a plain start of the same agent without sandbox and launcher (python, import rospy, init_node, first service
call), bare bubblewrap; a cloud agent from order to serving, and a call through the link beside its HTTP call. Exit status 1
when a budget is missed.
"""

import argparse
import asyncio
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi reads it when loaded, and logs on stdout

import numpy as np
import qi
import soundfile
from cloud_ways import measure_cloud
from phases import FIRST_CALL, ORDER, SPEECH_ENDED, UNDERSTOOD, Marks, Stamp, between, marks, timeline
from tornado.websocket import WebSocketClientConnection, websocket_connect

from rapp_cli.demo.config import add_options, read
from rapp_cli.demo.system import System, running_system
from rapp_cli.timeline import KINDS
from rapp_nao_sim.sound.synthesis import RATE, speak

RAPP = "clock"  # needs nothing of the cloud, so that its first call is to the robot
SAID = {"keyword": "what time is it", "command": "could you tell me the time please"}
VOICE = "en-us+m3"
LEVEL = 0.5  # of full scale at the microphone
SETTLED = 2.5  # s from listening again to the next command: the next spare is warm by then
PATIENCE = 15.0  # s for one activation
TRIES = 3  # of a command that is not understood
BUDGET = 0.150  # s from a command understood to the first call of an installed RApp (DESIGN section 4)
AIM = 1.0  # s from the end of speech to the first call of an installed RApp

PLAIN = """
import sys
import rospy
from rapp_msgs.srv import Say
rospy.init_node("plain_agent", disable_signals=True, disable_rosout=True)
rospy.wait_for_service("rapp_say", 5)
rospy.ServiceProxy("rapp_say", Say)(text="", language="en")
print("CALLED", flush=True)
rospy.signal_shutdown("measured")
"""


@dataclass
class Witness:
    """Hears what the agents publish, and when the robot notices the end of a sound."""

    stamps: list[Stamp] = field(default_factory=list)
    sound_ends: list[float] = field(default_factory=list)
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    async def follow(self, socket: WebSocketClientConnection) -> None:
        """Keep every state that comes, until the bridge leaves."""
        while (text := await socket.read_message()) is not None:
            message = json.loads(text)
            if message.get("op") == "publish":
                m = message["msg"]
                at = m["stamp"]["secs"] + m["stamp"]["nsecs"] * 1e-9
                self.stamps.append(Stamp(at, m["agent"], m["state"], KINDS[m["kind"]], m["detail"]))
                self.changed.set()

    async def wait_for(self, state: str, after: float) -> float:
        """When the core agent entered a state, at or after a time."""
        while True:
            for stamp in self.stamps:
                if (stamp.agent, stamp.kind, stamp.state) == ("core", "entered", state) and stamp.at >= after:
                    return stamp.at
            self.changed.clear()
            await self.changed.wait()

    def sound(self, value: Any) -> None:
        """ALMemory's SoundDetected, in a thread of libqi."""
        if isinstance(value, list) and value and not value[-1][1]:
            self.sound_ends.append(time.time())


@dataclass(frozen=True)
class Stage:
    """The running system with somebody in its room."""

    system: System
    home: Path
    socket: WebSocketClientConnection
    witness: Witness
    world: qi.Object
    sounds: dict[str, Path]

    async def say(self, way: str) -> float:
        """Say what asks for the RApp; gives when the last sample of speech left the person."""
        await asyncio.to_thread(lambda: self.world.personPlay(str(self.sounds[way]), _async=True).value(20_000))
        return time.time()

    async def remove(self) -> None:
        """Make the robot one that has never seen the RApp, nor the store."""
        call = {"job": uuid.uuid4().hex, "arguments": json.dumps({"name": RAPP}), "timeout": 10.0}
        await self.socket.write_message(json.dumps({"op": "call_service", "service": "rapp_hop/remove", "args": call}))
        async with asyncio.timeout(10):
            while (self.home / "rapps" / RAPP).exists():
                await asyncio.sleep(0.02)
        shutil.rmtree(self.home / "trust", ignore_errors=True)


def speech(text: str, file: Path) -> Path:
    """Write what a person says, cut where the speech ends: the synthesis goes on with silence."""
    samples = speak(text, VOICE) * LEVEL
    loud = np.flatnonzero(np.abs(samples) > 0.01 * np.abs(samples).max())
    soundfile.write(file, samples[loud[0] : loud[-1] + 1], RATE)
    return file


@asynccontextmanager
async def stage(folder: Path) -> AsyncIterator[Stage]:
    """Everything running; ended afterwards."""
    options = argparse.ArgumentParser()
    add_options(options)
    config = read(options.parse_args(["--folder", str(folder), "--voice", VOICE]), {})
    sounds = {way: speech(text, folder / f"{way}.wav") for way, text in SAID.items()}
    async with running_system(config) as system:
        witness, session = Witness(), qi.Session()
        socket = await websocket_connect(system.bridge, connect_timeout=5)
        topic = {"topic": "/core_agent/state", "type": "rapp_msgs/AgentState", "queue_length": 1000}
        await socket.write_message(json.dumps({"op": "subscribe", **topic}))
        following = asyncio.create_task(witness.follow(socket))
        await asyncio.to_thread(lambda: session.connect(system.robot, _async=True).value(5_000))
        subscriber = session.service("ALMemory").subscriber("SoundDetected")
        subscriber.signal.connect(witness.sound)
        try:
            yield Stage(system, folder / "robot", socket, witness, session.service("SimWorld"), sounds)
        finally:
            following.cancel()
            socket.close()
            await asyncio.to_thread(session.close)


async def activate(at: Stage, way: str, fresh: bool) -> Marks:
    """One activation, until the robot listens again; a command that is not understood is said again."""
    for _ in range(TRIES):
        if fresh:
            await at.remove()
        await asyncio.sleep(SETTLED)
        ended = await at.say(way)
        try:
            async with asyncio.timeout(PATIENCE):
                await at.witness.wait_for("s3", ended)
            return marks(ended, at.witness.sound_ends, at.witness.stamps)
        except (TimeoutError, ValueError) as error:
            print(f"bench activation: “{SAID[way]}” is said again: {error}", file=sys.stderr)
    raise SystemExit(f"cannot measure: “{SAID[way]}” was not understood {TRIES} times; see the logs in {at.system.logs}")


async def activations(at: Stage, rounds: int) -> dict[tuple[str, bool], list[Marks]]:
    """Activations by way and freshness, in turn, so that a busy machine slows all."""
    await at.witness.wait_for("s3", 0.0)
    kinds = [(way, fresh) for way in SAID for fresh in (True, False)]
    found: dict[tuple[str, bool], list[Marks]] = {kind: [] for kind in kinds}
    for _ in range(rounds):
        for way, fresh in kinds:
            found[way, fresh].append(await activate(at, way, fresh))
    return found


async def took(words: Sequence[str], env: dict[str, str], until: bytes | None = None) -> float:
    """Seconds from the start of a program to its end, or to a line it prints."""
    began = time.perf_counter()
    process = await asyncio.create_subprocess_exec(*words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=env)
    assert process.stdout is not None
    seconds = None
    async with asyncio.timeout(PATIENCE):
        async for line in process.stdout:
            if line.strip() == until:
                seconds = time.perf_counter() - began
        status = await process.wait()
    if status or (until is not None and seconds is None):
        raise SystemExit(f"cannot measure {words[0]}: it ended with status {status}")
    return time.perf_counter() - began if seconds is None else seconds


async def bare_starts(at: Stage, folder: Path, rounds: int) -> dict[str, float]:
    """Median seconds of what a launcher could not do faster without a warm process."""
    agent = folder / "agent.py"
    agent.write_text(PLAIN)
    env = {**os.environ, "ROS_MASTER_URI": at.system.master, "ROS_IP": "127.0.0.1", "ROS_LOG_DIR": str(folder / "plain")}
    python = [sys.executable, "-c", "pass"]
    sandbox = ["bwrap", "--ro-bind", "/", "/", "--dev", "/dev", "--proc", "/proc", "--unshare-pid", "--die-with-parent"]
    programs = {
        "python agent.py, to its first service call": ([sys.executable, str(agent)], b"CALLED"),
        "python -c pass": (python, None),
        "bwrap true": ([*sandbox, "true"], None),
        "bwrap python -c pass": ([*sandbox, *python], None),
    }
    times: dict[str, list[float]] = {name: [] for name in programs}
    for _ in range(rounds):
        for name, (words, until) in programs.items():
            times[name].append(await took(words, env, until))
    return {name: statistics.median(values) for name, values in times.items()}


def table(found: dict[tuple[str, bool], list[Marks]]) -> str:
    """Phases in ms: what each took, and when it was over, counted from the end of speech."""
    lines = {kind: timeline(all_marks) for kind, all_marks in found.items()}
    names = [f"{way}, {'fresh' if fresh else 'installed'}" for way, fresh in found]
    rows = [f"{'ms, medians':<38}" + "".join(f"{name:>20}" for name in names)]
    rows.append(f"{'':<38}" + f"{'took':>12}{'at':>8}" * len(names))
    for mark in ORDER[1:]:
        cells = [line.get(mark) for line in lines.values()]
        row = "".join(f"{c[0] * 1000:12.0f}{c[1] * 1000:8.0f}" if c else f"{'-':>12}{'-':>8}" for c in cells)
        rows.append(f"{mark:<38}{row}")
    return "\n".join(rows)


def verdict(found: dict[tuple[str, bool], list[Marks]], bare: dict[str, float]) -> bool:
    """Print the budgets, and whether they are kept."""
    plain = bare["python agent.py, to its first service call"]
    kept = True
    for way in SAID:
        installed = found[way, False]
        call, whole = between(installed, UNDERSTOOD, FIRST_CALL), between(installed, SPEECH_ENDED, FIRST_CALL)
        kept = kept and call <= BUDGET and whole <= AIM
        print(f"{way}, installed: RApp known to first call {call * 1000:.0f} ms (at most {BUDGET * 1000:.0f}),", end=" ")
        print(f"{call / plain:.2f} of a plain start; end of speech to first call {whole * 1000:.0f} ms (at most {AIM * 1000:.0f})")
    return kept


async def measure(folder: Path, rounds: int) -> int:
    """Run all; gives the exit status."""
    async with stage(folder) as at:
        found = await activations(at, rounds)
        bare = await bare_starts(at, folder, max(3, rounds))
        cloud = await measure_cloud(at.system.bridge, at.system.cloud, rounds)
    print(f"\nRApp {RAPP}, voice {VOICE}, {rounds} rounds; keyword “{SAID['keyword']}”, command “{SAID['command']}”\n")
    print(table(found) + "\n")
    for name, seconds in bare.items():
        print(f"{name:<58}{seconds * 1000:8.0f} ms")
    print()
    return 0 if all([verdict(found, bare), cloud.verdict()]) else 1


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="bench activation", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=5, help="activations of each kind (%(default)s; one takes about 10 s)")
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory(prefix="rapp-activation-") as folder:
        return asyncio.run(measure(Path(folder), rounds))


if __name__ == "__main__":
    sys.exit(main())
