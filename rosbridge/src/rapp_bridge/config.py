"""Settings of the bridge: one frozen object, from options, environment and defaults."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Config:
    """Every limit of the bridge."""

    address: str = "127.0.0.1"
    port: int = 9090  # 0: any free one
    call_timeout: float = 60.0  # s, of a service call either way, unless the client's `timeout` says otherwise
    calls: int = 1024  # service calls of one client that may be open at once
    connections: int = 64  # connections to one ROS service at once; further calls of it wait for one of them
    connection_age: float = 10.0  # s a connection to a service is kept; a service that moved is found after that
    response_limit: int = 64 << 20  # bytes of one service response
    requests: int = 256  # calls that may wait at once for one service of a client
    names: int = 1000  # topics and services one client may hold, counted per id
    frame_limit: int = 16 << 20  # bytes of one incoming frame
    queue_limit: int = 32 << 20  # bytes waiting for one client; topics lose their oldest first, then it is disconnected
    linger: float = 10.0  # s a publisher outlives its last client: rospy loses subscribers of a quick re-advertisement
    master_timeout: float = 5.0  # s, of one question to the ROS master
    ping_interval: float = 30.0  # s between pings to a client, and without a pong until it counts as gone


def read(words: Sequence[str], env: Mapping[str, str]) -> Config:
    """Read options, over environment (RAPP_BRIDGE_PORT), over defaults; exits with usage when an option is wrong."""
    default = Config()
    parser = argparse.ArgumentParser(prog="rosbridge", description="rosbridge v2 WebSocket server")
    parser.add_argument("--address", default=default.address, help="where to listen (%(default)s)")
    parser.add_argument("--port", type=int, default=env.get("RAPP_BRIDGE_PORT", default.port), help="0: any free one")
    parser.add_argument("--call-timeout", type=_positive, default=default.call_timeout, help="seconds (%(default)g)")
    parser.add_argument(
        "--queue-limit", type=int, default=default.queue_limit, help="bytes that may wait for one client (%(default)s)"
    )
    parser.add_argument(
        "--linger", type=float, default=default.linger, help="seconds a publisher outlives its last client (%(default)g)"
    )
    return Config(**vars(parser.parse_args(words)))


def _positive(text: str) -> float:
    value = float(text)
    if not value > 0:
        raise ValueError(text)
    return value
