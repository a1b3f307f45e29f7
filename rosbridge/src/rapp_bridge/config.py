"""Settings of the bridge: one frozen object, from options and environment."""

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Config:
    """Every limit of the bridge."""

    address: str = "127.0.0.1"
    port: int = 9090  # 0: any free one
    call_timeout: float = 60.0  # s, of a service call either way, unless the client says less
    calls: int = 64  # service calls open at once, and calls open at once of one client's service
    frame_limit: int = 16 << 20  # bytes of one incoming frame
    queue_limit: int = 64 << 20  # bytes waiting for one client; more, and it is disconnected
    ping_interval: float = 10.0  # s between pings to a client
    ping_timeout: float = 8.0  # s without a pong until a client counts as gone


def read(words: Sequence[str], env: Mapping[str, str] = os.environ) -> Config:
    """Read options, over environment (RAPP_BRIDGE_PORT), over defaults."""
    default = Config()
    parser = argparse.ArgumentParser(prog="rosbridge", description="rosbridge v2 WebSocket server")
    parser.add_argument("--address", default=default.address, help="where to listen (%(default)s)")
    parser.add_argument("--port", type=int, default=int(env.get("RAPP_BRIDGE_PORT", default.port)), help="0: any free one")
    parser.add_argument("--call-timeout", type=float, default=default.call_timeout, help="seconds (%(default)s)")
    options = parser.parse_args(words)
    return Config(address=options.address, port=options.port, call_timeout=options.call_timeout)
