import json

import pytest

from rapp_bridge.errors import Invalid
from rapp_bridge.protocol import (
    TEXT_LIMIT,
    Advertise,
    CallService,
    ServiceResponse,
    Subscribe,
    decode,
    error_status,
    parse,
    publication,
    service_request,
    service_result,
)


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


@pytest.mark.parametrize(
    "fields",
    [
        {},
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


def test_answers_are_written_with_the_ids_they_were_asked_with() -> None:
    assert json.loads(service_result(CallService("/s", {}, 7), {"a": 1}, True)) == {
        "op": "service_response", "service": "/s", "values": {"a": 1}, "result": True, "id": 7,
    }  # fmt: skip
    assert "id" not in json.loads(service_result(CallService("/s", {}), "no", False))
    assert json.loads(service_request("/s", "r1", {})) == {"op": "call_service", "id": "r1", "service": "/s", "args": {}}
    assert json.loads(error_status("cannot", "i")) == {"op": "status", "level": "error", "msg": "cannot", "id": "i"}


def test_a_long_error_is_cut() -> None:
    assert len(json.loads(error_status("x" * 10_000_000))["msg"]) == TEXT_LIMIT


def test_numbers_keep_their_precision_and_what_is_no_number_is_null() -> None:
    text = publication("/x", {"big": 2**64 - 1, "nan": float("nan"), "inf": [float("-inf"), 1.5]})
    assert json.loads(text)["msg"] == {"big": 2**64 - 1, "nan": None, "inf": [None, 1.5]}


def test_a_string_that_is_no_utf8_is_still_sent() -> None:
    assert json.loads(publication("/x", {"data": "a\udc80"}))["msg"] == {"data": "a\udc80"}


def test_a_response_keeps_its_values_as_they_are() -> None:
    assert decode({"op": "service_response", "service": "/s", "id": "1", "result": False, "values": "why"}) == ServiceResponse(
        "/s", "1", False, "why"
    )
