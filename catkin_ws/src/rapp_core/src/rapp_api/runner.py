"""The process of a dynamic agent: a warm spare at first, then the RApp it is told to be (`python -m rapp_api.runner`).

Started by the core agent's launcher inside its sandbox, with one end of the channel as descriptor RAPP_CHANNEL_FD.
"""

import importlib.util
import json
import logging
import os
import socket
import sys
import threading
from pathlib import Path
from typing import Any

import rospy

from rapp_agent import Event
from rapp_api import core_agent
from rapp_api.dynamic_agent import DynamicAgent
from rapp_api.errors import Invalid
from rapp_api.ros_core_agent import RosCoreAgent

HEARTBEAT = 0.25  # s
DISMANTLE = 30.0  # s after "terminate" for the core agent to ask for dismantling; then this process ends anyway

_log = logging.getLogger(__name__)


class Channel:
    """This end of the channel: JSON objects, one per line."""

    def __init__(self, descriptor: int) -> None:
        self._socket = socket.socket(fileno=descriptor)
        self._lines = self._socket.makefile("rb")
        self._lock = threading.Lock()

    def send(self, **message: Any) -> None:
        """Send one message; the process ends when the core agent is gone, for it can do nothing without."""
        try:
            with self._lock:
                self._socket.sendall(json.dumps(message).encode() + b"\n")
        except OSError:
            os._exit(1)

    def receive(self) -> dict[str, Any] | None:
        """Wait for the next message; None when the core agent has closed the channel."""
        line = self._lines.readline()
        return dict(json.loads(line)) if line else None


def main() -> int:
    """Warm up, wait to be activated, be the dynamic agent, end."""
    logging.basicConfig(level=logging.INFO, stream=sys.stderr)
    channel = Channel(int(os.environ["RAPP_CHANNEL_FD"]))
    rospy.init_node("dynamic_agent", anonymous=True, disable_signals=True, disable_rosout=True)
    channel.send(type="ready")
    order = channel.receive()
    if order is None:
        return 0
    dismantle = threading.Event()
    threading.Thread(target=_obey, args=(channel, dismantle), daemon=True).start()
    threading.Thread(target=_beat, args=(channel,), daemon=True).start()
    core_agent.use(RosCoreAgent(order["token"]))
    agent = _be(channel, order)
    if dismantle.wait(DISMANTLE) and agent is not None:
        agent.dismantle()
    channel.send(type="gone")
    return 0


def _be(channel: Channel, order: dict[str, Any]) -> DynamicAgent | None:
    """Run the RApp; whatever it raises is reported, not lost."""
    try:
        agent = load(Path(order["package"]) / order["entry"])(order["parameters"])
        agent.run(lambda: channel.send(type="first_word", name=type(agent).__name__), _terminate(channel), _event(channel))
    except Exception as error:  # noqa: BLE001 - reported to the core agent, whatever it is
        _log.exception("the RApp failed")
        channel.send(type="terminate", outcome="failed", detail=f"{type(error).__name__}: {error}")
        return None
    return agent


def _terminate(channel: Channel) -> Any:
    def send(error: Exception | None) -> None:
        if error is not None:
            _log.error("the RApp failed", exc_info=error)
        outcome = "done" if error is None else "failed"
        channel.send(type="terminate", outcome=outcome, detail="" if error is None else f"{type(error).__name__}: {error}")

    return send


def _event(channel: Channel) -> Any:
    def tell(event: Event) -> None:
        channel.send(type="state", machine=event.machine, state=event.state, kind=event.kind, detail=event.detail)

    return tell


def load(entry: Path) -> type[DynamicAgent]:
    """The DynamicAgent class that a RApp's entry file defines. Raises Invalid when there is not just one."""
    spec = importlib.util.spec_from_file_location("rapp_entry", entry)
    if spec is None or spec.loader is None or not entry.is_file():
        raise Invalid(f"cannot run {entry.name}: it is no Python file")
    sys.path.insert(0, str(entry.parent))
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    classes = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, DynamicAgent) and value.__module__ == spec.name
    ]
    if len(classes) != 1:
        raise Invalid(f"cannot run {entry.name}: it must define one class derived from DynamicAgent, not {len(classes)}")
    return classes[0]


def _obey(channel: Channel, dismantle: threading.Event) -> None:
    while (order := channel.receive()) is not None:
        if order["type"] == "dismantle":
            dismantle.set()
    os._exit(1)  # the core agent is gone


def _beat(channel: Channel) -> None:
    while True:
        channel.send(type="heartbeat", count=core_agent.activity.count)
        threading.Event().wait(HEARTBEAT)


if __name__ == "__main__":
    sys.exit(main())
