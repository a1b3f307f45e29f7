"""Settings of the bridge: one frozen object, from options, environment and defaults."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Config:
    """Every limit of the bridge."""

    address: str = "127.0.0.1"
    port: int = 9090  # 0: any free one
    listener: int = -1  # descriptor of a socket that listens already, in place of address and port
    guest: bool = False  # in a ROS where it may offer nothing of its own: no rosapi, no word of who is connected
    service_types: tuple[str, ...] = ()  # loaded at the start: the first call of one takes 0.1 s less
    certfile: str = ""  # PEM file for TLS; empty: none
    keyfile: str = ""  # PEM file; empty: in the certificate's file
    access_file: str = ""  # tokens and what they open; empty: everybody may do everything
    origin: tuple[str, ...] = ()  # pages that may connect, beside those of this machine; "*": all
    clients: int = 2000  # connections at once
    entry_timeout: float = 10.0  # s from connecting until the handshake, and the authentication, are done
    call_timeout: float = 60.0  # s, of a service call either way, unless the client's `timeout` says otherwise
    calls: int = 1024  # service calls of one client that may be open at once
    connections: int = 64  # connections to one ROS service at once; further calls of it wait for one of them
    connection_age: float = 10.0  # s a connection to a service is kept; a service that moved is found after that
    response_limit: int = 64 << 20  # bytes of one service message from a node
    message_limit: int = 256 << 20  # bytes of one topic message from a node
    requests: int = 256  # calls that may wait at once for one service of a client
    names: int = 1000  # topics and services one client may hold, counted per id
    frame_limit: int = 16 << 20  # bytes of one incoming message
    frame_rate: int = 200_000  # messages a client may send in a second; one that sends more is disconnected
    fragment_timeout: float = 60.0  # s until a message of which parts are missing is forgotten
    queue_limit: int = 16 << 20  # bytes waiting for one client, or node; topics lose their oldest first, then a client is cut off
    linger: float = 10.0  # s that publishers and subscribers outlive their last client, for pages that are reloaded
    master_timeout: float = 5.0  # s, of one question to the ROS master
    probe_timeout: float = 1.0  # s, of one question to a node; a dead one delays no answer longer
    ping_interval: float = 30.0  # s between pings to a client, and without a word until it counts as gone


def read(words: Sequence[str], env: Mapping[str, str]) -> Config:
    """Read options, over environment (RAPP_BRIDGE_PORT), over defaults; exits with usage when an option is wrong."""
    default = Config()
    parser = argparse.ArgumentParser(prog="rosbridge", description="rosbridge v2 WebSocket server")
    parser.add_argument("--address", default=default.address, help="where to listen (%(default)s)")
    parser.add_argument("--port", type=int, default=env.get("RAPP_BRIDGE_PORT", default.port), help="0: any free one")
    parser.add_argument("--listener", type=int, default=-1, metavar="FD", help="socket that listens already, in their place")
    parser.add_argument("--guest", action="store_true", help="offer no services, topics and parameters of the bridge's own")
    parser.add_argument("--service-type", action="append", default=[], metavar="TYPE", help="load it at the start; may be repeated")
    parser.add_argument("--certfile", default="", help="PEM file of the certificate: listen with TLS (wss://)")
    parser.add_argument("--keyfile", default="", help="PEM file of its key, when it is not in the same file")
    parser.add_argument("--access-file", default="", help="TOML file of tokens: clients have to authenticate")
    parser.add_argument(
        "--origin", action="append", default=[], help="web origin that may connect, such as https://example.org; may be repeated"
    )
    for name, kind, text in (
        ("call-timeout", _positive, "seconds until a service call fails"),
        ("connection-age", _positive, "seconds that a connection to a ROS service is kept"),
        ("queue-limit", int, "bytes that may wait for one client"),
        ("frame-limit", int, "bytes of one message from a client"),
        ("frame-rate", int, "messages a client may send in a second"),
        ("names", int, "topics and services one client may hold"),
        ("calls", int, "calls of one client that may be open at once"),
        ("requests", int, "calls that may wait at once for one service of a client"),
        ("clients", int, "clients at once"),
        ("linger", float, "seconds that publishers and subscribers outlive their last client"),
        ("entry-timeout", _positive, "seconds a client has for handshake and authentication"),
        ("ping-interval", _positive, "seconds between pings; a client silent for two of them is gone"),
    ):
        standard = getattr(default, name.replace("-", "_"))
        parser.add_argument(f"--{name}", type=kind, default=standard, help=f"{text} (%(default)s)")
    given = vars(parser.parse_args(words))
    types = tuple(given.pop("service_type"))
    return Config(**{**given, "origin": tuple(given["origin"]), "service_types": types})


def _positive(text: str) -> float:
    value = float(text)
    if not value > 0:
        raise ValueError(text)
    return value
