"""The process of a dynamic agent: a warm spare at first, then the RApp it is told to be (`python -m rapp_api.runner`).

Started by the core agent's launcher inside its sandbox, with one end of the channel as descriptor RAPP_CHANNEL_FD, and the way to
its gate as RAPP_GATE_FD.
"""

import logging
import os
import signal
import socket
import sys
import threading
from types import FrameType

import rospy

from rapp_api import core_agent, javascript
from rapp_api.channel import SocketChannel
from rapp_api.gate import hand_over_if_guarded
from rapp_api.life import Bounds, live
from rapp_api.ros_core_agent import RosCoreAgent

ENDED = (signal.SIGTERM, signal.SIGINT)
LOG_FORMAT = "%(asctime)s %(name)s %(levelname)s %(message)s"


def main() -> None:
    """Warm up, wait to be activated, be the dynamic agent, leave ROS, end the process."""
    for number in ENDED:
        signal.signal(number, _told_to_end)
    _run(socket.socket(fileno=int(os.environ["RAPP_CHANNEL_FD"])))
    _leave()


def _run(end: socket.socket) -> None:
    channel = SocketChannel(end, _lost)
    hand_over_if_guarded()
    engine = javascript.warm_up(os.environ.pop("RAPP_WARM", ""))
    rospy.init_node("dynamic_agent", anonymous=True, disable_signals=True, disable_rosout=True)
    logging.basicConfig(level=logging.INFO, format=LOG_FORMAT, stream=sys.stderr, force=True)  # rospy has put in its own
    channel.send(type="ready")
    order = channel.receive()
    wanted = order is not None and order.get("runtime") == javascript.RUNTIME
    if engine is not None and not (wanted and engine.alive):
        engine.end()
        engine = None
    if order is None:
        return
    if order["type"] != "activate":
        channel.send(type="gone")
    elif wanted:
        status = javascript.live(channel, order, _lost, Bounds(), engine or javascript.Engine())
        if status != 0:
            _exit(status)
    else:
        core_agent.use(RosCoreAgent(order.get("token", "")))
        live(channel, order, _lost, Bounds())


def _told_to_end(_number: int, _frame: FrameType | None) -> None:
    """Leave from a thread: an exception here could be swallowed by whatever the RApp or rospy is just doing."""
    for number in ENDED:
        signal.signal(number, signal.SIG_DFL)  # a second signal means: at once
    threading.Thread(target=_leave, name="leave", daemon=True).start()


def _leave() -> None:
    rospy.signal_shutdown("the dynamic agent has ended")
    _exit(0)  # what threads the RApp has left must not keep the process


def _lost() -> None:
    """The core agent is gone, and with it all that this process is for."""
    _exit(1)


def _exit(status: int) -> None:
    logging.shutdown()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(status)


if __name__ == "__main__":
    main()
