"""/diagnostics: how the robot and its ways to the outside are (diagnostic_msgs; REP 107)."""

from collections.abc import Callable
from dataclasses import dataclass

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from rapp_core.body_ports import Feeling
from rapp_core.errors import CoreError
from rapp_core.ros.topics.streams import Stream, Topic

PERIOD = 1.0  # s
LOW_BATTERY = 0.2  # share of the charge


@dataclass(frozen=True)
class Health:
    """What is known at one moment; None: the robot does not answer, or has no such sense."""

    state: str  # of the core FSM
    robot: bool
    battery: float | None  # 0..1
    fallen: bool | None
    link: bool


def diagnostics_stream(
    feeling: Feeling, robot: Callable[[], bool], link: Callable[[], bool], state: Callable[[], str], idle: Callable[[], None]
) -> Stream:
    """The topic, once per second."""

    def measure() -> Health:
        try:
            senses = feeling.senses()
        except CoreError:
            return Health(state(), robot(), None, None, link())
        return Health(state(), robot(), senses.battery, senses.fallen, link())

    publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=5)
    return Stream("diagnostics", PERIOD, measure, [Topic(publisher, lambda health: array(health, rospy.Time.now()))], idle)


def array(health: Health, stamp: rospy.Time) -> DiagnosticArray:
    """One status each for core agent, robot and link."""
    found = [
        status("core agent", DiagnosticStatus.OK, f"in {health.state}", state=health.state),
        _robot(health),
        status("link", *((DiagnosticStatus.OK, "present") if health.link else (DiagnosticStatus.WARN, "away"))),
    ]
    message = DiagnosticArray(status=found)
    message.header.stamp = stamp
    return message


def _robot(health: Health) -> DiagnosticStatus:
    if not health.robot:
        return status("robot", DiagnosticStatus.ERROR, "NAOqi does not answer")
    battery = "unknown" if health.battery is None else f"{health.battery:.0%}"
    if health.fallen:
        return status("robot", DiagnosticStatus.ERROR, "has fallen", battery=battery)
    if health.battery is not None and health.battery < LOW_BATTERY:
        return status("robot", DiagnosticStatus.WARN, "battery is low", battery=battery)
    return status("robot", DiagnosticStatus.OK, "present", battery=battery)


def status(name: str, level: int, message: str, **values: str) -> DiagnosticStatus:
    """One line of the array."""
    pairs = [KeyValue(key, value) for key, value in values.items()]
    return DiagnosticStatus(level=level, name=f"rapp: {name}", message=message, hardware_id="nao", values=pairs)
