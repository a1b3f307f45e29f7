"""Connections to robots, and the brokers of this program."""

import atexit
import contextlib
import os
import threading
import time
from typing import Any, Protocol

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi logs on standard output otherwise; read when it is loaded
os.environ.setdefault("QI_EVENTLOOP_MIN_THREADS", "8")

import qi

CONNECT_TIMEOUT = 10_000  # ms
CALLS_TIMEOUT = 1.0  # s, for calls of modules to end when the program does
DRAIN = 0.1  # s, for libqi's threads to let go of the program's objects when it ends

_lock = threading.Lock()
_sessions: dict[str, Any] = {}
_brokers: list["Broker"] = []
_calls: set[threading.Thread] = set()


class Broker(Protocol):
    """What modules and proxies need of an ALBroker."""

    session: Any

    def getName(self) -> str: ...  # noqa: D102, N802 - as ALBroker
    def add(self, module: Any) -> None: ...  # noqa: D102
    def remove(self, module: Any) -> None: ...  # noqa: D102
    def shutdown(self) -> None: ...  # noqa: D102


def connect(ip: str, port: int) -> Any:
    """The session with a robot, the same for all proxies to it; raises RuntimeError."""
    url = f"tcp://{ip}:{port}"
    with _lock:
        session = _sessions.get(url)
        if session is None or not session.isConnected():
            session = _sessions[url] = fresh(url)
        return session


def fresh(url: str) -> Any:
    """A session of its own; raises RuntimeError."""
    session = qi.Session()
    session.connect(url, _async=True).value(CONNECT_TIMEOUT)
    return session


def run(call: threading.Thread) -> None:
    """Start a thread that is waited for, for a while, when the program ends."""
    with _lock:
        _calls.intersection_update([known for known in _calls if known.is_alive()])
        _calls.add(call)
        call.start()


@atexit.register
def _leave_all() -> None:
    """Leave all robots: a thread of libqi that calls the program after the interpreter's end would abort it."""
    for broker in list(_brokers):
        broker.shutdown()
    for session in _sessions.values():
        with contextlib.suppress(RuntimeError):
            session.close()
    deadline = time.monotonic() + CALLS_TIMEOUT
    for call in list(_calls):
        call.join(max(0.0, deadline - time.monotonic()))
    time.sleep(DRAIN)


def enter(broker: Broker) -> None:
    """Make a broker the one that modules and proxies without an address use."""
    with _lock:
        _brokers.append(broker)


def leave(broker: Broker) -> None:
    """Use the one before again."""
    with _lock:
        if broker in _brokers:
            _brokers.remove(broker)


def current(asker: str) -> Broker:
    """The broker in use; raises RuntimeError when there is none."""
    with _lock:
        if not _brokers:
            raise RuntimeError(f"{asker}\n\tcannot find a broker: give the robot's address, or create an ALBroker first")
        return _brokers[-1]
