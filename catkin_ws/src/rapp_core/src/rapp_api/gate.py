"""Giving the gate the sandbox's own sockets: the only way between this process and the robot's ROS (DESIGN section 3.6).

A socket stays in the network in which it was made. The gate, outside, accepts at listeners made here, where the ROS master seems
to be, and comes to this node over unconnected sockets made here. It is done before any RApp's code runs.
"""

import os
import socket
from urllib.parse import urlsplit

import rosgraph

CONNECTIONS = 64  # from the robot's nodes to this one's topics, over the whole run
BATCH = 16  # descriptors in one message
BACKLOG = 64
LOOPBACK = "127.0.0.1"


def hand_over(number: int) -> None:
    """Send the sockets over descriptor `number`, and keep none: first the listeners of ROS master and relay, then the others."""
    port = urlsplit(rosgraph.get_master_uri()).port
    with socket.socket(fileno=number) as end:
        _send(end, [socket.create_server((LOOPBACK, each), backlog=BACKLOG) for each in (port or 0, 0)])
        for _ in range(CONNECTIONS // BATCH):
            _send(end, [socket.socket(socket.AF_INET, socket.SOCK_STREAM) for _ in range(BATCH)])


def hand_over_if_guarded() -> None:
    """As `hand_over`, when a gate guards this process."""
    number = os.environ.pop("RAPP_GATE_FD", None)
    if number is not None:
        hand_over(int(number))


def _send(end: socket.socket, sockets: list[socket.socket]) -> None:
    socket.send_fds(end, [b"s"], [each.fileno() for each in sockets])
    for each in sockets:
        each.close()
