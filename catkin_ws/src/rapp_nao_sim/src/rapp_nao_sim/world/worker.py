"""A process of the world and the line to it: numbered requests one way, answers in any order the other way.

pybullet holds the interpreter's lock while it works, so physics and renderer are processes of their own. A child ends when its
line closes, so none outlives its parent, however that ends.
"""

import logging
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from multiprocessing.connection import Connection
from typing import Any, NoReturn

from rapp_nao_sim.world.errors import Bug, Refused, Unreachable, WorldError

STOP_TIMEOUT = 0.3  # s, for a child to end by itself; three are to end within 2 s
SEND_TIMEOUT = 5  # s, for a child to take a request from the line
CALL_TIMEOUT = 5.0  # s, for an answer that needs no movement

WAIT = object()  # given by a handler whose answer comes later

_log = logging.getLogger(__name__)


class Worker:
    """The parent's side of a child process running a module's `main`; callable from any thread."""

    def __init__(self, module: str) -> None:
        self._module = module
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._line: Connection | None = None
        self._reader: threading.Thread | None = None
        self._waiting: dict[int, Future[Any]] = {}
        self._next = 0
        self._open = False  # until the child closes the line, which it may do a moment before it can be waited for

    def start(self) -> None:
        """Start the process; it serves once it answers its first call. Raises Unreachable."""
        ours, theirs = socket.socketpair()
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("ll", SEND_TIMEOUT, 0))
        with theirs:
            words = [sys.executable, "-m", self._module, str(theirs.fileno())]
            try:
                # pybullet prints on standard output, which belongs to the parent's READY line.
                self._process = subprocess.Popen(words, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, stdout=2)
            except OSError as error:
                ours.close()
                raise Unreachable(f"cannot start {self._module}: {error}") from error
        self._line = Connection(ours.detach())
        self._open = True
        self._reader = threading.Thread(target=self._read, args=(self._line,), name=self._module, daemon=True)
        self._reader.start()

    def close(self) -> None:
        """End the process and wait for it; what still waits for an answer fails as Unreachable."""
        process, line = self._process, self._line
        if process is None or line is None:
            return
        # Shut down, not closed: the reader still uses the descriptor, and would read whatever next gets its number.
        with socket.socket(fileno=os.dup(line.fileno())) as end:
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                _log.debug("%s had already left", self._module)
        try:
            process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            _log.warning("%s does not end by itself: killed", self._module)
            process.kill()
            process.wait()
        if self._reader is not None:
            self._reader.join()
        with self._lock:
            line.close()
            self._process = self._line = None

    def alive(self) -> bool:
        """Whether the process runs."""
        process = self._process
        return self._open and process is not None and process.poll() is None

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return None if self._process is None else self._process.pid

    def call(self, verb: str, *args: Any, timeout: float = CALL_TIMEOUT) -> Any:
        """Ask and wait for the answer; raises the child's WorldError, or Unreachable when there is none in time."""
        future = self._send(verb, args)
        try:
            return future.result(timeout)
        except FutureTimeout as error:
            raise Unreachable(f"cannot {verb}: the world did not answer in {timeout:g} s; start the simulator again") from error

    def _send(self, verb: str, args: tuple[Any, ...]) -> "Future[Any]":
        future: Future[Any] = Future()
        with self._lock:
            if self._line is None or not self.alive():
                raise Unreachable(f"cannot {verb}: the world's process is not running; start the simulator again")
            self._next += 1
            self._waiting[self._next] = future
            try:
                self._line.send((self._next, verb, args))
            except OSError as error:
                del self._waiting[self._next]
                if self._process is not None:
                    self._process.kill()  # half a request may be on the line: nothing after it can be understood
                raise Unreachable(f"cannot {verb}: the world's process does not listen; start the simulator again") from error
        return future

    def _read(self, line: Connection) -> None:
        while True:
            try:
                number, answer = line.recv()
            except (EOFError, OSError):
                break
            with self._lock:
                future = self._waiting.pop(number)
            if isinstance(answer, WorldError):
                future.set_exception(answer)
            else:
                future.set_result(answer)
        with self._lock:
            self._open = False
            left, self._waiting = list(self._waiting.values()), {}
        for future in left:
            future.set_exception(Unreachable("cannot go on: the world's process has ended; start the simulator again"))


class Service:
    """The child's side: reads requests from its line and answers them with handlers named by verb."""

    def __init__(self, line: Connection) -> None:
        self._line = line
        self._handlers: dict[str, Callable[..., Any]] = {}
        self.number = 0  # of the request being handled

    def offer(self, handlers: dict[str, Callable[..., Any]]) -> None:
        """Add handlers."""
        self._handlers |= handlers

    def pending(self, timeout: float | None) -> bool:
        """Whether a request comes within the time, s."""
        return self._line.poll(timeout)

    def handle(self) -> None:
        """Handle one request; raises EOFError when the parent has gone."""
        self.number, verb, args = self._line.recv()
        try:
            answer = self._handlers[verb](*args)
        except WorldError as error:
            answer = error
        except (TypeError, ValueError) as error:
            answer = Refused(f"cannot {verb}: {error}; correct the arguments")
        except (LookupError, ArithmeticError, AttributeError, RuntimeError, OSError) as error:
            _log.exception("%s failed", verb)
            answer = Bug(f"cannot {verb}: {error!r}; see the simulator's log")
        if answer is not WAIT:
            self.answer(self.number, answer)

    def answer(self, number: int, answer: Any) -> None:
        """Answer a request that was made to wait."""
        try:
            self._line.send((number, answer))
        except OSError:
            raise EOFError from None


def serve(build: Callable[[Service], Callable[[], None]], words: list[str]) -> NoReturn:
    """Run a child: `build` makes its parts and gives what to run until the parent leaves; the process ends with it.

    It ends at once, having nothing to tidy up: on a busy machine an interpreter with pybullet in it takes longer than STOP_TIMEOUT.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends us, after it has ended what needs us
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    status = 1
    with Connection(int(words[1])) as line:
        try:
            build(Service(line))()
        except EOFError:
            status = 0
    os._exit(status)
