"""Stops the robot when its core agent is gone (DESIGN section 3.1): a small process beside the core agent that outlives it.

The core agent holds one end of a pipe that nobody else has; the kernel closes it when the core agent ends, however that comes.
Then the guard stops motion, speech, playing, recording, listening and looking, twice, since what the core agent had just asked for
may reach the robot after the first time; and ends. A core agent that stands still gives no sign through the pipe: then the guard
stops what the robot does, not what it hears and sees, and goes on watching, since the core agent may go on. It speaks NAOqi only,
and works the same on a robot and on the simulator. A NAO does not stop by itself what a client has started that is gone.
"""

import argparse
import contextlib
import fcntl
import logging
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from rapp_core.errors import CoreError, Refused
from rapp_core.robot.naoqi.camera import subscriptions
from rapp_core.robot.naoqi.connection import Connection

AGAIN = 0.3  # s between the two times
LATEST = 2.0  # s after the core agent's end: a robot that is not reached until then is left to the next core agent
ANSWER = 0.5  # s for the robot to take a stop
LOOK = 0.02  # s between two looks whether it has gone
LEAVING = 1.0  # s for the guard to end when it is told to
RESTART = 0.5  # s before a guard that has ended is started anew
SIGN = b"."  # the core agent's sign of life
EVERY = 0.25  # s between two signs
SILENT = 8  # waits of `EVERY` without a sign before the core agent is taken to stand still; those of the guard's own life count
DONE = b"done"  # told by a core agent that has stopped the robot itself

_log = logging.getLogger(__name__)


class Guard:
    """The core agent's end. Entered, it starts the process, and again should it end; left without an error, it ends it."""

    def __init__(self, robot: str, subscriber: str, home: Path) -> None:
        """`subscriber` is the name under which the core agent listens; one data folder has one guard at a time."""
        self._words = [sys.executable, "-m", "rapp_core.robot.naoqi.guard", "--robot", robot, "--subscriber", subscriber]
        self._lock_file = home / "guard.lock"
        self._closing = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        self._keeper = threading.Thread(target=self._keep, name="guard", daemon=True)

    def __enter__(self) -> "Guard":
        self._process = self._start()
        self._keeper.start()
        return self

    def __exit__(self, error: type[BaseException] | None, *_: object) -> None:
        self._closing.set()
        self._keeper.join()
        if self._process is not None:
            _end(self._process, told=error is None)

    @property
    def pid(self) -> int | None:
        """Process id of the guard."""
        return None if self._process is None else self._process.pid

    def _start(self) -> "subprocess.Popen[bytes]":
        """Start the process, in a session of its own: what ends the core agent's group does not end it."""
        lock = self._take_lock()
        try:
            process = subprocess.Popen(
                self._words,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                pass_fds=(lock,),
                start_new_session=True,
                bufsize=0,
            )
        finally:
            os.close(lock)
        assert process.stdin is not None
        os.set_blocking(process.stdin.fileno(), False)  # a guard that stands still holds nobody up
        return process

    def _take_lock(self) -> int:
        """Wait until the guard of an earlier core agent has ended, so that it does not stop what this one starts.

        The lock belongs to the open file, which the process inherits, and so is held until that ends.
        """
        lock = os.open(self._lock_file, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        deadline = time.monotonic() + LATEST + LEAVING
        while time.monotonic() < deadline:
            with contextlib.suppress(BlockingIOError):
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return lock
            time.sleep(LOOK)
        _log.warning("the guard of an earlier core agent is still there")
        return lock

    def _keep(self) -> None:
        """Give the signs of life, in a thread of their own: what the core agent does may take its time."""
        while not self._closing.wait(EVERY):
            process = self._process
            if process is not None and process.poll() is None:
                _tell(process, SIGN)
                continue
            if process is not None:
                _log.warning("the guard has ended with status %s: it is started again", process.returncode)
                _end(process, told=True)
                self._process = None
            if not self._closing.wait(RESTART):
                try:
                    self._process = self._start()
                except OSError as error:
                    _log.error("cannot start the guard: %s", error)


def _tell(process: "subprocess.Popen[bytes]", word: bytes) -> None:
    """Say something to a guard; one that does not listen is seen by its end."""
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError):
        process.stdin.write(word)


def _end(process: "subprocess.Popen[bytes]", told: bool) -> None:
    """Let a guard end, that is told or else shall stop the robot, and reap it."""
    assert process.stdin is not None
    if told:
        _tell(process, DONE)
    process.stdin.close()
    try:
        process.wait(LEAVING if told else LATEST + LEAVING)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


Stop = tuple[str, ...]  # module, method and arguments of a call that stops something
ACTING: list[Stop] = [
    ("ALMotion", "stopMove"),
    ("ALMotion", "killAll"),
    ("ALRobotPosture", "stopMove"),
    ("ALTextToSpeech", "stopAll"),
    ("ALAudioPlayer", "stopAll"),
]
"""What stops all that the robot does; motion first."""


def sensing(subscriber: str) -> list[Stop]:
    """What stops all that the core agent hears and sees."""
    return [
        ("ALAudioRecorder", "stopMicrophonesRecording"),
        ("ALSpeechRecognition", "unsubscribe", subscriber),
        ("ALSoundDetection", "unsubscribe", subscriber),
        ("ALSonar", "unsubscribe", subscriber),
        *(("ALVideoDevice", "unsubscribeAllInstances", name) for name in subscriptions(subscriber)),
    ]


def still(connection: Connection, stops: Sequence[Stop]) -> bool:
    """Ask for all stops at once, then wait for them; gives whether the robot has answered each."""
    answers, reached = [], True
    for module, method, *arguments in stops:
        try:
            answers.append(connection.start(module, method, *arguments))
        except Refused as error:
            _log.info("%s", error)
        except CoreError as error:
            _log.warning("%s", error)
            reached = False
    deadline = time.monotonic() + ANSWER
    for answer in answers:
        answer.wait(round(max(0.0, deadline - time.monotonic()) * 1000))
        reached = reached and answer.isFinished()
    return reached


def stop_robot(connection: Connection, stops: Sequence[Stop]) -> bool:
    """Ask for all stops, twice; gives whether the robot was reached in time."""
    deadline, times = time.monotonic() + LATEST, 0
    while times < 2 and time.monotonic() < deadline:
        times += still(connection, stops)
        if times < 2:
            time.sleep(AGAIN)
    return times == 2


def watch(signs: int, silent: Callable[[], object]) -> bool:
    """Read a core agent's signs until it has ended, calling `silent` once each time they cease; gives whether it has said DONE.

    A guard that had no turn has not waited: a computer that slept or has too much to do is no core agent that stands still.
    """
    last, waits = b"", 0
    while True:
        if select.select([signs], [], [], EVERY)[0]:
            heard = os.read(signs, 4096)
            if not heard:
                return last == DONE
            if waits >= SILENT:
                _log.info("the core agent goes on")
            last, waits = (last + heard)[-len(DONE) :], 0
        else:
            waits += 1
            if waits == SILENT:
                silent()


def main() -> int:
    """Wait for the core agent's end or word; gives the exit status."""
    parser = argparse.ArgumentParser(prog="guard", description="stops the robot when its core agent, on standard input, is gone")
    parser.add_argument("--robot", required=True, help="URL of NAOqi")
    parser.add_argument("--subscriber", required=True, help="name under which the core agent listens")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s guard %(levelname)s %(message)s", stream=sys.stderr)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if watch(sys.stdin.fileno(), lambda: _stop(options.robot, "stands still", ACTING)):
        return 0
    return 0 if _stop(options.robot, "is gone", ACTING + sensing(options.subscriber)) else 1


def _stop(robot: str, why: str, stops: Sequence[Stop]) -> bool:
    """Stop the robot over a session of this occasion; gives whether it was reached in time."""
    _log.warning("the core agent %s: the robot is stopped", why)
    connection = Connection(robot, ANSWER)
    try:
        reached = stop_robot(connection, stops)
    finally:
        connection.close()
    if not reached:
        _log.error("cannot stop the robot: it did not answer in %g s; the next core agent stops it", LATEST)
    return reached


if __name__ == "__main__":
    sys.exit(main())
