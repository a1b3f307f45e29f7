"""Value rules of rosbridge on ROS 1, with the real message classes; no node, no master."""

import base64
import io
import json
import math
from typing import Any

import genpy
import pytest
from geometry_msgs.msg import PoseStamped
from rapp_msgs.srv import Say
from sensor_msgs.msg import Image, Imu, LaserScan
from std_msgs.msg import (
    Bool,
    Byte,
    ByteMultiArray,
    ColorRGBA,
    Duration,
    Float64,
    Header,
    Int8,
    Int8MultiArray,
    Int64,
    String,
    Time,
    UInt8,
    UInt8MultiArray,
    UInt64,
)
from std_srvs.srv import Empty, SetBool

from rapp_bridge.conversion import arguments, from_json, message_class, service_class, writer
from rapp_bridge.errors import Invalid
from rapp_bridge.protocol import publication


def over_the_wire(message: Any) -> Any:
    """The message as rospy gives it after receiving it."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return message.__class__().deserialize(buffer.getvalue())


def as_json(message: Any) -> Any:
    return json.loads(publication("/t", writer(message.__class__)(message)))["msg"]


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        (String("ä/\n"), {"data": "ä/\n"}),
        (Bool(True), {"data": True}),
        (UInt64(2**64 - 1), {"data": 2**64 - 1}),
        (Int64(-(2**63)), {"data": -(2**63)}),
        (Float64(math.nan), {"data": None}),
        (Float64(-math.inf), {"data": None}),
        (Time(genpy.Time(3, 5)), {"data": {"secs": 3, "nsecs": 5}}),
        (Duration(genpy.Duration(-3, 5)), {"data": {"secs": -3, "nsecs": 5}}),
        (
            UInt8MultiArray(data=b"\x00\xffabc"),
            {"layout": {"dim": [], "data_offset": 0}, "data": base64.b64encode(b"\x00\xffabc").decode()},
        ),
        (Int8MultiArray(data=[-1, 2]), {"layout": {"dim": [], "data_offset": 0}, "data": [-1, 2]}),
        (ByteMultiArray(data=[-1, 2]), {"layout": {"dim": [], "data_offset": 0}, "data": [-1, 2]}),
    ],
)
def test_values_to_json_and_back(message: Any, expected: Any) -> None:
    given = as_json(over_the_wire(message))
    assert given == expected
    assert as_json(over_the_wire(from_json(given, message.__class__))) == expected


def test_nested_messages_and_arrays_go_there_and_back() -> None:
    scan = LaserScan(
        header=Header(frame_id="laser", stamp=genpy.Time(1, 2)), ranges=[1.5, math.inf, math.nan], intensities=[0.25]
    )
    given = as_json(over_the_wire(scan))
    assert given["ranges"] == [1.5, None, None]
    assert given["header"]["stamp"] == {"secs": 1, "nsecs": 2}
    back = over_the_wire(from_json(given, LaserScan))
    assert back.ranges[0] == 1.5
    assert math.isnan(back.ranges[1])
    assert back.header.frame_id == "laser"


def test_a_picture_is_base64_text() -> None:
    given = as_json(over_the_wire(Image(height=1, width=2, data=b"\x01\x02\x03")))
    assert given["data"] == "AQID"
    assert from_json({"data": [1, 2, 3]}, Image).data == from_json({"data": "AQID"}, Image).data == b"\x01\x02\x03"


def test_missing_fields_keep_their_defaults_and_a_header_given_without_stamp_is_stamped_now() -> None:
    assert from_json({}, PoseStamped).header.stamp == genpy.Time(0, 0)
    stamped = from_json({"header": {"frame_id": "map"}}, PoseStamped)
    assert stamped.header.stamp > genpy.Time(1_500_000_000, 0)
    assert from_json({"header": {"stamp": {"secs": 7}}}, PoseStamped).header.stamp == genpy.Time(7, 0)
    assert from_json({"data": "now"}, Time).data > genpy.Time(1_500_000_000, 0)


def test_an_integer_is_welcome_for_a_float() -> None:
    assert over_the_wire(from_json({"data": 3}, Float64)).data == 3.0


@pytest.mark.parametrize(
    ("values", "cls", "text"),
    [
        ([], String, r"std_msgs/String: an object is needed, not a list"),
        ({"data": 3}, String, r"std_msgs/String\.data: a string is needed, not an integer"),
        ({"data": "x"}, Float64, r"Float64\.data: a number is needed, not a string"),
        ({"data": True}, Float64, r"not a bool"),
        ({"data": 1}, Bool, r"a bool is needed, not an integer"),
        ({"data": 1.0}, Int8, r"an integer is needed, not a float"),
        ({"data": True}, Int8, r"an integer is needed, not a bool"),
        ({"data": None}, Int8, r"an integer is needed, not null"),
        ({"data": 128}, Int8, r"128 does not fit int8, which goes from -128 to 127"),
        ({"data": 128}, Byte, r"128 does not fit byte"),
        ({"data": -1}, UInt8, r"-1 does not fit uint8"),
        ({"data": [1, 2, 300]}, UInt8MultiArray, r"UInt8MultiArray\.data\[2\]: 300 does not fit"),
        ({"data": "!"}, UInt8MultiArray, r"\.data: .*base64"),
        ({"data": "€"}, UInt8MultiArray, r"\.data: .*base64"),
        ({"data": {}}, UInt8MultiArray, r"a list is needed, not an object"),
        ({"dat": ""}, String, r"it has no field dat; it has data"),
        ({"a": 1}, Empty._request_class, r"it has no field a; it has none"),
        ({"orientation_covariance": [1.0] * 8}, Imu, r"9 elements are needed, not 8"),
        ({"pose": {"position": {"x": "1"}}}, PoseStamped, r"geometry_msgs/PoseStamped\.pose\.position\.x: a number"),
        ({"data": {"secs": -1}}, Time, r"-1 does not fit uint32"),
        ({"data": {"secs": 0, "nsecs": -1}}, Time, r"a time is not negative"),
        ({"data": "later"}, Time, r"a time is an object of secs and nsecs"),
        ({"data": {"sec": 1}}, Duration, r"a duration is an object of secs and nsecs"),
        ({"r": "1"}, ColorRGBA, r"ColorRGBA\.r"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(values: Any, cls: Any, text: str) -> None:
    with pytest.raises(Invalid, match=text) as caught:
        from_json(values, cls)
    assert str(caught.value).startswith("cannot fill ")


def test_arguments_come_by_position_or_by_name() -> None:
    assert arguments([True], SetBool._request_class).data is True
    assert arguments(["hello"], Say._request_class).text == "hello"
    assert arguments({"text": "hello"}, Say._request_class).text == "hello"
    assert arguments([], Say._request_class).text == ""
    with pytest.raises(Invalid, match="cannot call with 2 arguments"):
        arguments([True, 1], SetBool._request_class)


@pytest.mark.parametrize("name", ["", "String", "std_msgs/None", "no_msgs/None", "std_msgs/../x", "/", "a/b/c"])
def test_unknown_types_are_refused_by_name(name: str) -> None:
    for find in (message_class, service_class):
        with pytest.raises(Invalid, match=r"^cannot use"):
            find(name)


def test_converters_are_compiled_once() -> None:
    assert writer(LaserScan) is writer(LaserScan)
