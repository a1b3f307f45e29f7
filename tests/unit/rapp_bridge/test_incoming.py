import math
import struct

import cbor2
import pytest
from std_msgs.msg import Float32MultiArray

from rapp_bridge.encoding import encode
from rapp_bridge.errors import Invalid
from rapp_bridge.incoming import decode, parse
from rapp_bridge.protocol import Advertise, Auth, CallService, Fragment, Publish, ServiceResponse, SetLevel, Subscribe


def test_what_roslibpy_sends_is_read() -> None:
    assert decode(
        {"op": "advertise", "id": "advertise:/x:1", "type": "std_msgs/String", "topic": "/x", "latch": False, "queue_size": 100}
    ) == Advertise("/x", "std_msgs/String", "advertise:/x:1", False, 100)
    assert decode(
        {
            "op": "subscribe",
            "id": "s",
            "type": "std_msgs/String",
            "topic": "/x",
            "compression": "none",
            "throttle_rate": 5,
            "queue_length": 2,
        }
    ) == Subscribe("/x", "std_msgs/String", "s", 5, 2)
    assert decode({"op": "call_service", "id": "c", "service": "/s", "args": {"a": 1}}) == CallService("/s", {"a": 1}, "c")


def test_absent_and_null_are_the_default() -> None:
    assert decode({"op": "subscribe", "topic": "x", "queue_length": None, "type": None}) == Subscribe("x")
    assert decode({"op": "call_service", "service": "s"}) == CallService("s", {})


@pytest.mark.parametrize(("given", "read"), [(2, 2), (0.5, 0.5), (0, None), (-1, None), (None, None)])
def test_a_call_may_bring_its_own_timeout(given: float | None, read: float | None) -> None:
    message = decode({"op": "call_service", "service": "s", "timeout": given})
    assert isinstance(message, CallService)
    assert message.timeout == read


@pytest.mark.parametrize(
    "frame", ["", "{", "[]", "3", '"x"', "null", '{"op":"publish"} {"op":"publish"}', '{"op":"x"} ]', "{" * 6000, b"\xff{}"]
)
def test_a_frame_is_one_json_object(frame: str | bytes) -> None:
    with pytest.raises(Invalid, match=r"^cannot read the message"):
        parse(frame)


def test_a_binary_frame_with_json_is_read() -> None:
    assert parse(b'{"op": "x"}') == {"op": "x"}


CONSTANTS = '{"op":"publish","topic":"/x","msg":{"data":[NaN,Infinity,-Infinity,1.5]}%s}'


@pytest.mark.parametrize("as_bytes", [True, False])
def test_what_python_s_json_writes_for_nan_and_infinity_is_read(as_bytes: bool) -> None:
    text = CONSTANTS % ',"id":"ä\\ud83d\\ude00"'
    fields = parse(text.encode() if as_bytes else text)
    assert fields["id"] == "ä😀"
    assert encode(fields["msg"], Float32MultiArray)[-16:] == struct.pack("<4f", math.nan, math.inf, -math.inf, 1.5)


@pytest.mark.parametrize(
    "more",
    ["}", ',"id":"\\ud800"', f',"id":{1 << 70}', f',"id":{"9" * 5000}', ',"id":' + "[" * 900 + "]" * 900, ',"id":' + "[" * 90_000,
     ',"id":"\n"'],
    ids=["brace", "surrogate", "big-integer", "huge-integer", "deep", "deeper", "control"],
)  # fmt: skip
def test_beside_nan_all_is_refused_that_is_refused_without(more: str) -> None:
    with pytest.raises(Invalid, match=r"^cannot read the message"):
        parse(CONSTANTS % more)


def test_beside_nan_bytes_that_are_no_text_are_refused() -> None:
    with pytest.raises(Invalid, match=r"^cannot read the message"):
        parse((CONSTANTS % ',"id":"?"').encode().replace(b"?", b"\xff"))


@pytest.mark.parametrize("name", ["/", "~", "~/", "//", "*", "/a b", "/a-b", "1a", "/" + "a" * 1000])
def test_what_names_no_topic_and_no_service_is_refused_by_its_name(name: str) -> None:
    with pytest.raises(Invalid, match=r"^cannot serve the message: topic '.*' is no ROS name$"):
        decode({"op": "subscribe", "topic": name})
    with pytest.raises(Invalid, match=r"^cannot serve the message: service '.*' is no ROS name$"):
        decode({"op": "call_service", "service": name})


def test_what_roslibjs_sends_is_read() -> None:
    assert decode(
        {"op": "subscribe", "id": "subscribe:/x:1", "type": "std_msgs/String", "topic": "/x", "compression": "cbor",
         "throttle_rate": 0, "queue_length": 0, "reconnect_on_close": True}
    ) == Subscribe("/x", "std_msgs/String", "subscribe:/x:1", 0, 0, None, "cbor")  # fmt: skip
    assert decode({"op": "publish", "id": "publish:/x:2", "topic": "/x", "msg": {"data": ""}, "latch": True}) == Publish(
        "/x", {"data": ""}, "publish:/x:2", False, True
    )
    assert decode({"op": "call_service", "id": "c", "service": "rosapi/nodes", "args": {}, "timeout": None}) == CallService(
        "rosapi/nodes", {}, "c"
    )
    assert decode({"op": "set_level", "level": "info", "id": "s"}) == SetLevel("info", "s")
    assert decode({"op": "auth", "mac": "ab", "client": "c", "dest": "d", "rand": "r", "t": 1, "level": "admin", "end": 2}) == Auth(
        "", "ab", "c", "d", "r", 1, "admin", 2
    )
    assert decode({"op": "fragment", "id": "i", "num": 0, "total": 2, "data": "{"}) == Fragment("i", 0, 2, "{")


def test_a_legacy_call_has_its_id_in_the_service_name() -> None:
    assert decode({"op": "call_service", "service": "/name#7"}) == CallService("/name#7", {}, "7")
    assert decode({"op": "call_service", "service": "/name#7", "id": "own"}) == CallService("/name#7", {}, "own")


def test_a_cbor_frame_is_read_as_a_json_one() -> None:
    fields = {"op": "publish", "topic": "/x", "msg": {"data": b"\x00\xff", "more": [1, 2.5, None, True, "ä"]}}
    assert parse(cbor2.dumps(fields)) == fields
    assert decode(
        parse(cbor2.dumps({"op": "publish", "topic": "/x", "msg": {"bytes": b""}, "compression": "cbor-raw"}))
    ) == Publish("/x", {"bytes": b""}, None, True)


@pytest.mark.parametrize(
    "frame",
    [
        b"\xa1",
        b"\xa1\x62op",
        b"\xa1\x62o\xff\x00",
        b"\xbf",
        b"\xbb" + b"\xff" * 8,
        b"\xa1\x61a" + b"\x81" * 70_000,
        b"\xa1\x61a\x9b" + b"\xff" * 8,
        b"\xa1\x61a\x5b" + b"\x7f" * 8,
        b"\xa2\x61a\x00\x61a\x01",
        b"\xa1\x61a\xd8\x55\x43abc",
        b"\xa1\x61a\xd8\x23\x64(a+)",
        b"\xa1\x61a\xc0\x6a2020-01-01",
        b"\xa1\x61a\xd8\x1c\x80",
        b"\xa1\x80\x00",
    ],
)
def test_hostile_cbor_is_refused(frame: bytes) -> None:
    with pytest.raises(Invalid, match=r"^cannot read the message"):
        parse(frame)


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"op": "subscribe", "topic": "/x", "fragment_size": "9"},
        {"op": "subscribe", "topic": "/x", "fragment_size": 0},
        {"op": "subscribe", "topic": "/x", "fragment_size": 2.5},
        {"op": "subscribe", "topic": "/x", "compression": "zip"},
        {"op": "subscribe", "topic": "/x" * 600},
        {"op": "call_service", "service": "/s", "fragment_size": -1},
        {"op": "call_service", "service": "#7"},
        {"op": "fragment", "id": "i", "num": "0", "total": 2, "data": ""},
        {"op": "fragment", "id": "i", "num": 0, "total": 2.0, "data": ""},
        {"op": "fragment", "num": 0, "total": 2, "data": ""},
        {"op": "set_level", "level": "loud"},
        {"op": "set_level"},
        {"op": "auth", "t": "now"},
        {"op": "auth", "mac": 1},
        {"op": None},
        {"op": ["publish"]},
        {"op": "dance"},
        {"op": "publish"},
        {"op": "publish", "topic": ""},
        {"op": "publish", "topic": "*"},
        {"op": "publish", "topic": "/x y"},
        {"op": "publish", "topic": "/x", "msg": []},
        {"op": "advertise", "topic": "/x"},
        {"op": "advertise", "topic": "/x", "type": 3},
        {"op": "advertise", "topic": "/x", "type": "a/B", "latch": 1},
        {"op": "subscribe", "topic": "/x", "throttle_rate": -1},
        {"op": "subscribe", "topic": "/x", "throttle_rate": 10**18},
        {"op": "subscribe", "topic": "/x", "throttle_rate": 1.5},
        {"op": "subscribe", "topic": "/x", "queue_length": True},
        {"op": "subscribe", "topic": "/x", "id": [1]},
        {"op": "call_service", "service": "/s", "args": "x"},
        {"op": "call_service", "service": "/s", "timeout": "1"},
        {"op": "service_response", "service": "/s", "result": True},
        {"op": "service_response", "service": "/s", "id": "1", "result": 1},
    ],
)
def test_fields_of_a_wrong_kind_are_named(fields: dict[str, object]) -> None:
    with pytest.raises(Invalid, match=r"^cannot serve"):
        decode(fields)


def test_a_response_keeps_its_values_as_they_are() -> None:
    assert decode({"op": "service_response", "service": "/s", "id": "1", "result": False, "values": "why"}) == ServiceResponse(
        "/s", "1", False, "why"
    )
