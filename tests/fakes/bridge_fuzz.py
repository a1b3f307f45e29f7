"""Frames that are nearly good: messages of clients, changed at random. The same seed gives the same frames."""

import json
import os
import random
import zlib
from copy import deepcopy
from typing import Any

import cbor2

SEEDS = (7, 1914)
"""For every run; beside them a test takes `new_seed`, and prints it."""

MESSAGES: tuple[dict[str, Any], ...] = (
    {"op": "advertise", "topic": "/fuzz", "type": "std_msgs/String", "id": "a", "latch": False, "queue_size": 10},
    {"op": "publish", "topic": "/fuzz", "msg": {"data": "text"}, "id": 1},
    {"op": "publish", "topic": "/fuzz_scan", "msg": {"header": {"stamp": {"secs": 1, "nsecs": 2}}, "ranges": [0.5, 1, None]}},
    {"op": "publish", "topic": "/fuzz_image", "msg": {"height": 1, "width": 2, "data": "AAEC", "header": {"frame_id": "f"}}},
    {"op": "unadvertise", "topic": "/fuzz"},
    {"op": "subscribe", "topic": "/fuzz", "type": "std_msgs/String", "throttle_rate": 10, "queue_length": 1, "compression": "cbor"},
    {"op": "subscribe", "topic": "/fuzz", "id": "s", "fragment_size": 10, "compression": "none"},
    {"op": "unsubscribe", "topic": "/fuzz", "id": "s"},
    {"op": "call_service", "service": "/fuzzed", "args": {"text": "a", "language": "en"}, "id": "c", "timeout": 0.5},
    {"op": "call_service", "service": "rosapi/get_param", "args": ["/fuzz_param", "1"], "fragment_size": 20},
    {"op": "call_service", "service": "/rosapi/set_param", "args": {"name": "/fuzz_param", "value": '{"a": [1, "b"]}'}},
    {"op": "call_service", "service": "/rosapi/message_details", "args": {"type": "sensor_msgs/Image"}},
    {"op": "advertise_service", "service": "/fuzz_service", "type": "std_srvs/SetBool"},
    {"op": "service_response", "service": "/fuzz_service", "id": "service_request:/fuzz_service:1", "result": True, "values": {}},
    {"op": "unadvertise_service", "service": "/fuzz_service"},
    {"op": "fragment", "id": "f", "num": 0, "total": 2, "data": '{"op":"publish","topic":"/fuzz",'},
    {"op": "fragment", "id": "f", "num": 1, "total": 2, "data": '"msg":{}}'},
    {"op": "set_level", "level": "error"},
    {"op": "auth", "mac": "00", "client": "c", "dest": "d", "rand": "r", "t": 1, "level": "l", "end": 2},
    {"op": "png", "data": "AAAA", "png": 1, "fragment_size": "x", "message_intervall": -1},
)

VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1 << 31, -(1 << 63), 1 << 64, 1e308, -0.0, "", "/", "~", "a" * 3000, "\0", "\ud7ff", "/fuzz",
    "now", [], {}, [[[[]]]], {"data": {"data": {}}}, [None] * 50, {"secs": -1, "nsecs": 1 << 40}, "AAA", "std_msgs/String", "x/y/z",
    "none",
)  # fmt: skip
"""What a field may be replaced by."""

WORDS = (
    b"1e999", b"-" * 20, b"9" * 5000, b"[" * 3000, b'{"a":' * 2000, b"NaN", b"\xff\xfe", b"\xc0\x80", b"\\ud800", b"\0", b"}{",
    b'"', b"\xbf", b"\x9f" * 200, b"\xc2\x59\xff\xff", b"\xd8\x56", b"\xfb\x7f\xf8\0\0\0\0\0\0",
)  # fmt: skip
"""What may be put into the bytes of a frame."""


def new_seed() -> int:
    """RAPP_FUZZ_SEED, to see a failure again, or one that was never used."""
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID")  # processes that share the tests have to name them alike
    fresh = zlib.crc32(run.encode()) if run else random.SystemRandom().randrange(1 << 32)
    return int(os.environ.get("RAPP_FUZZ_SEED", 0)) or fresh


class Fuzz:
    """Makes frames."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)

    def frame(self) -> tuple[bytes, bool]:
        """A frame's payload, and whether it is to go as a binary one."""
        fields = deepcopy(self.random.choice(MESSAGES))
        for _ in range(self.random.choice((0, 1, 1, 2, 4))):
            self._change(fields)
        is_cbor = self.random.random() < 0.4
        data = cbor2.dumps(fields) if is_cbor else json.dumps(fields).encode()
        for _ in range(self.random.choice((0, 0, 1, 1, 3))):
            data = self._damaged(data)
        return data, is_cbor or self.random.random() < 0.1

    def _change(self, fields: dict[str, Any]) -> None:
        """Replace, remove or add a field, at any depth."""
        place: Any = fields
        while isinstance(place, dict) and place and self.random.random() < 0.5:
            inner = self.random.choice(list(place.values()))
            if not isinstance(inner, dict):
                break
            place = inner
        name = self.random.choice([*place, "op", "extra", "header"])
        if self.random.random() < 0.2:
            place.pop(name, None)
        else:
            place[name] = deepcopy(self.random.choice(VALUES))

    def _damaged(self, data: bytes) -> bytes:
        at = self.random.randrange(len(data) + 1)
        match self.random.randrange(5):
            case 0:
                return data[:at]
            case 1:
                return data[:at] + bytes([self.random.randrange(256)]) + data[at + 1 :]
            case 2:
                return data[:at] + self.random.choice(WORDS) + data[at:]
            case 3:
                return data[:at] + data[at // 2 :]
            case _:
                return data + data
