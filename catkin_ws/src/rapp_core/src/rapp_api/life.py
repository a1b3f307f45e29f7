"""The life of a dynamic agent from activation to "gone", as told over its channel. Knows no ROS."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_agent import Event
from rapp_api.channel import Channel
from rapp_api.cloud import stop_agent_wait
from rapp_api.core_agent import activity
from rapp_api.dynamic_agent import DynamicAgent
from rapp_api.entry import load
from rapp_api.errors import RappError

LONGEST_DETAIL = 500  # characters; the core agent ends who sends too long a line

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Bounds:
    """Times of a life."""

    heartbeat: float = 0.25  # s between heartbeats
    dismantle: float = 30.0  # s from "terminate" for the core agent to ask for dismantling; without it this ends anyway


def live(channel: Channel, order: dict[str, Any], lost: Callable[[], None], bounds: Bounds) -> None:
    """Be the RApp that the "activate" message names; returns when "gone" is said.

    `lost` is called, in a thread of its own, when the core agent closes the channel before that.
    """
    dismantle, gone = threading.Event(), threading.Event()

    def obey() -> None:
        while (message := channel.receive()) is not None:
            if message["type"] == "dismantle":
                dismantle.set()
        if not gone.is_set():
            lost()

    def beat() -> None:
        while not gone.is_set():
            channel.send(type="heartbeat", count=activity.count, waits=activity.waits)
            gone.wait(bounds.heartbeat)

    for work in (obey, beat):
        threading.Thread(target=work, name=work.__name__, daemon=True).start()
    agent = _be(channel, order)
    asked = dismantle.wait(bounds.dismantle)
    if asked:
        _dismantle(agent, has_cloud_agent=bool(order.get("cloud_agent")))
    gone.set()
    channel.send(type="gone")


def _be(channel: Channel, order: dict[str, Any]) -> DynamicAgent | None:
    """Load and run the RApp; whatever it raises is reported. Gives the agent, if it came to be."""
    agent = None
    try:
        agent = load(Path(order["package"]) / order["entry"])(order["parameters"])
        first_word = {"type": "first_word", "name": type(agent).__name__}
        agent.run(lambda: channel.send(**first_word), lambda error: _terminate(channel, error), lambda e: _tell(channel, e))
    except (Exception, SystemExit) as error:  # noqa: BLE001 - reported to the core agent, whatever it is
        _terminate(channel, error)
    return agent


def _terminate(channel: Channel, error: BaseException | None) -> None:
    """Fig. 3, s5."""
    if error is None:
        channel.send(type="terminate", outcome="done", detail="")
        return
    _log.error("the RApp has failed", exc_info=error)
    channel.send(type="terminate", outcome="failed", detail=f"{type(error).__name__}: {error}"[:LONGEST_DETAIL])


def _tell(channel: Channel, event: Event) -> None:
    detail = event.detail[:LONGEST_DETAIL]
    channel.send(type="state", machine=event.machine, state=event.state, kind=event.kind, detail=detail)


def _dismantle(agent: DynamicAgent | None, *, has_cloud_agent: bool) -> None:
    """The cloud agent goes last: what the RApp does in `dismantle` may need it."""
    if agent is not None:
        try:
            agent.dismantle()
        except Exception:  # noqa: BLE001 - logged; the core agent stops what is left itself (deliverable section 3.2)
            _log.exception("the RApp could not stop what it has started")
    if has_cloud_agent:
        try:
            stop_agent_wait()
        except RappError as error:
            _log.warning("%s; the core agent sees to it", error)
