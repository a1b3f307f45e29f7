"""Connections to robots, and the brokers of this program."""

import os
import threading
from typing import Any, Protocol

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi logs on standard output otherwise; read when it is loaded
os.environ.setdefault("QI_EVENTLOOP_MIN_THREADS", "8")

import qi

CONNECT_TIMEOUT = 10_000  # ms

_lock = threading.Lock()
_sessions: dict[str, Any] = {}
_brokers: list["Broker"] = []


class Broker(Protocol):
    """What modules and proxies need of an ALBroker."""

    session: Any

    def getName(self) -> str: ...  # noqa: D102, N802 - as ALBroker
    def add(self, module: Any) -> None: ...  # noqa: D102
    def remove(self, module: Any) -> None: ...  # noqa: D102


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
