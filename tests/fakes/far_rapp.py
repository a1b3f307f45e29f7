"""A process in a RApp's place: it calls `rapp_api` for a test, under a lease that was lent to it (see `fakes.lender`)."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from typing import Any

PATIENCE = 60.0  # s for one call


class FarRapp:
    """Calls functions in a process of its own, which is a node of the robot's ROS."""

    def __init__(self, ros: Mapping[str, str], token: str) -> None:
        spawn = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(1, mp_context=spawn, initializer=_join, initargs=(dict(ros), token))

    def begin(self, function: Callable[..., Any], *args: Any) -> "Future[Any]":
        """Call a function there; it must be one that can be imported."""
        return self._pool.submit(function, *args)

    def call(self, function: Callable[..., Any], *args: Any) -> Any:
        """Call a function there, and wait; raises what it raises."""
        return self.begin(function, *args).result(PATIENCE)

    def close(self) -> None:
        """End the process, though it may still wait for something."""
        for process in list(self._pool._processes.values()):
            process.kill()
        self._pool.shutdown(cancel_futures=True)


def _join(ros: dict[str, str], token: str) -> None:
    os.environ |= ros
    import rospy

    from rapp_api import core_agent
    from rapp_api.ros_core_agent import RosCoreAgent

    rospy.init_node("far_rapp", anonymous=True, disable_signals=True, disable_rosout=True)
    core_agent.use(RosCoreAgent(token))


def goal(name: str, fields: Mapping[str, Any]) -> tuple[int, bool, str]:
    """Send a goal to an action and wait: the goal's state, success, kind of error."""
    import rapp_msgs.msg

    from rapp_api import navigation
    from rapp_api.ros_actions import ACTIONS

    client = navigation.action_client(name)
    client.wait_for_server()
    client.send_goal(getattr(rapp_msgs.msg, f"{ACTIONS[name]}Goal")(**fields))
    client.wait_for_result()
    result = client.get_result()
    return client.get_state(), result.success, result.error


def stopped_after(seconds: float, call: Callable[..., Any], *args: Any) -> str:
    """What a motion's caller is told when another thread of the RApp stops it; "" when it has ended before."""
    from rapp_api import RappError, navigation

    stop = threading.Timer(seconds, navigation.move_stop)
    stop.start()
    try:
        call(*args)
    except RappError as error:
        return str(error)
    finally:
        stop.join()
    return ""
