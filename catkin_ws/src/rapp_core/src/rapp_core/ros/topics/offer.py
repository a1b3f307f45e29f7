"""All topics of one robot beside those of the agents' states."""

from collections.abc import Callable

from rapp_core.body_ports import Pose2D
from rapp_core.config import Config
from rapp_core.ports import Hop, Robot
from rapp_core.ros.topics.body import body_stream
from rapp_core.ros.topics.camera import camera_stream
from rapp_core.ros.topics.diagnostics import diagnostics_stream
from rapp_core.ros.topics.streams import Stream
from rapp_core.trace import Trace


def streams(
    robot: Robot, hop: Hop, trace: Trace, odom_in_map: Callable[[], Pose2D], held: Callable[[], bool], config: Config
) -> list[Stream]:
    """The streams, to be started; each measures only while somebody subscribes to one of its topics.

    Afterwards the sense is idle, unless a RApp holds the lease (`held`): then it is when that has ended.
    """
    feel, see = unless(held, robot.feeling.close), unless(held, robot.camera.close)
    resolution, period = config.camera_resolution, 1 / config.camera_rate
    return [
        body_stream(robot.motion, robot.feeling, odom_in_map, 1 / config.body_rate, feel),
        *(camera_stream(robot.camera, name, resolution, period, see) for name in ("top", "bottom")),
        diagnostics_stream(robot.feeling, robot.present, lambda: hop.present, lambda: trace.state, feel),
    ]


def unless(held: Callable[[], bool], close: Callable[[], None]) -> Callable[[], None]:
    """What closes a sense that no RApp may be using; one that another stream wants wakes at its next look."""
    return lambda: None if held() else close()
