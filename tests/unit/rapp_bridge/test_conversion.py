"""Value rules of rosbridge on ROS 1, with the real message classes; no node, no master."""

import base64
import io
import json
import math
import struct
from typing import Any

import cbor2
import genpy
import pytest
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rapp_msgs.srv import Say
from sensor_msgs.msg import CameraInfo, Image, Imu, JointState, Joy, LaserScan, PointCloud2, PointField
from std_msgs.msg import (
    Bool,
    Byte,
    ByteMultiArray,
    ColorRGBA,
    Duration,
    Float32,
    Float32MultiArray,
    Float64,
    Float64MultiArray,
    Header,
    Int8,
    Int8MultiArray,
    Int16MultiArray,
    Int64,
    Int64MultiArray,
    MultiArrayDimension,
    String,
    Time,
    UInt8,
    UInt8MultiArray,
    UInt16MultiArray,
    UInt64,
    UInt64MultiArray,
)
from std_srvs.srv import Empty, SetBool
from tf2_msgs.msg import TFMessage

from rapp_bridge.arrays import Numbers
from rapp_bridge.cbor import read
from rapp_bridge.decoding import decode
from rapp_bridge.encoding import encode, encode_arguments
from rapp_bridge.errors import Invalid
from rapp_bridge.forms import APART, CBOR, JSON, cbor_pieces, json_pieces
from rapp_bridge.rostypes import message_class, service_class


def serialized(message: Any) -> bytes:
    """The message as rospy sends it."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def from_json(values: Any, cls: Any) -> Any:
    """The message as rospy gives it after receiving what we send."""
    return cls().deserialize(bytes(encode(values, cls)))


def as_json(message: Any) -> Any:
    return json.loads(b"".join(json_pieces(decode(serialized(message), type(message), JSON))))


def as_cbor(message: Any) -> Any:
    return cbor2.loads(b"".join(cbor_pieces(decode(serialized(message), type(message), CBOR))))


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
    given = as_json(message)
    assert given == expected
    assert as_json(from_json(given, type(message))) == expected


def test_nested_messages_and_arrays_go_there_and_back() -> None:
    scan = LaserScan(header=Header(frame_id="laser", stamp=genpy.Time(1, 2)), ranges=[1.5, math.inf, math.nan], intensities=[0.25])
    given = as_json(scan)
    assert given["ranges"] == [1.5, None, None]
    assert given["header"]["stamp"] == {"secs": 1, "nsecs": 2}
    back = from_json(given, LaserScan)
    assert back.ranges[0] == 1.5
    assert math.isnan(back.ranges[1])
    assert back.header.frame_id == "laser"


def test_a_picture_is_base64_text() -> None:
    given = as_json(Image(height=1, width=2, data=b"\x01\x02\x03"))
    assert given["data"] == "AQID"
    assert from_json({"data": [1, 2, 3]}, Image).data == from_json({"data": "AQID"}, Image).data == b"\x01\x02\x03"


@pytest.mark.parametrize("text", [base64.encodebytes(bytes(200)).decode(), " A A==\t", "AA==\r\n\v\f"])
def test_base64_text_may_be_broken_into_lines(text: str) -> None:
    assert not any(from_json({"data": text}, UInt8MultiArray).data)


def test_missing_fields_keep_their_defaults_and_a_header_given_without_stamp_is_stamped_now() -> None:
    assert from_json({}, PoseStamped).header.stamp > genpy.Time(1_500_000_000, 0), "as the protocol's document promises"
    assert from_json({}, Path).header.stamp > genpy.Time(1_500_000_000, 0)
    assert from_json({"poses": [{}]}, Path).poses[0].header.stamp > genpy.Time(1_500_000_000, 0)
    stamped = from_json({"header": {"frame_id": "map"}}, PoseStamped)
    assert stamped.header.stamp > genpy.Time(1_500_000_000, 0)
    assert from_json({"header": {"stamp": {"secs": 7}}}, PoseStamped).header.stamp == genpy.Time(7, 0)
    assert from_json({"data": "now"}, Time).data > genpy.Time(1_500_000_000, 0)


def test_an_integer_is_welcome_for_a_float() -> None:
    assert from_json({"data": 3}, Float64).data == 3.0


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
    for args in (["hello"], {"text": "hello"}):
        assert Say._request_class().deserialize(bytes(encode_arguments(args, Say._request_class))).text == "hello"
    assert encode_arguments([True], SetBool._request_class) == b"\1"
    assert encode_arguments([], SetBool._request_class) == b"\0"
    with pytest.raises(Invalid, match="cannot call with 2 arguments"):
        encode_arguments([True, 1], SetBool._request_class)


@pytest.mark.parametrize("name", ["", "String", "std_msgs/None", "no_msgs/None", "std_msgs/../x", "/", "a/b/c"])
def test_unknown_types_are_refused_by_name(name: str) -> None:
    for find in (message_class, service_class):
        with pytest.raises(Invalid, match=r"^cannot use"):
            find(name)


SAMPLES = [
    String("x"),
    String("€" * 300),
    Float32(0.1),
    Bool(False),
    Odometry(child_frame_id="base", header=Header(seq=9, stamp=genpy.Time(4, 5), frame_id="odom")),
    Path(poses=[PoseStamped(header=Header(frame_id=str(number))) for number in range(3)]),
    TFMessage(transforms=[TransformStamped(child_frame_id="a"), TransformStamped(child_frame_id="bc")]),
    JointState(name=["a", "", "ccc"], position=[1.0, 2.5], velocity=[-0.0]),
    LaserScan(ranges=[0.1, 1e30, 3.0], intensities=[]),
    PointCloud2(fields=[PointField(name="x", count=1)], data=bytes(range(200)), is_dense=True),
    OccupancyGrid(data=[-1, 0, 100]),
    Imu(orientation_covariance=[float(number) for number in range(9)]),
    Joy(axes=[0.5], buttons=[1, -1]),
    UInt64MultiArray(data=[0, 2**64 - 1]),
    Int64MultiArray(data=[-(2**63), 2**63 - 1]),
    Image(data=bytes(range(256)) * 400),
    CameraInfo(),
    GoalStatusArray(status_list=[GoalStatus(text="x")]),
]


@pytest.mark.parametrize("message", SAMPLES, ids=lambda message: message._type)
def test_what_rospy_sends_goes_to_json_and_back_byte_by_byte(message: Any) -> None:
    assert encode(as_json(message), type(message)) == serialized(message)


@pytest.mark.parametrize("message", SAMPLES, ids=lambda message: message._type)
def test_what_rospy_sends_goes_to_cbor_and_back_byte_by_byte(message: Any) -> None:
    frame = b"".join(cbor_pieces(decode(serialized(message), type(message), CBOR)))
    assert encode(read(frame), type(message)) == serialized(message)


def test_cbor_carries_bytes_and_typed_arrays_little_endian() -> None:
    assert as_cbor(Image(data=b"\x00\xff"))["data"] == b"\x00\xff"
    assert as_cbor(LaserScan(ranges=[1.5]))["ranges"] == cbor2.CBORTag(85, struct.pack("<f", 1.5))
    assert as_cbor(Float64MultiArray(data=[1.5]))["data"] == cbor2.CBORTag(86, struct.pack("<d", 1.5))
    assert as_cbor(Int8MultiArray(data=[-1]))["data"] == cbor2.CBORTag(72, b"\xff")
    assert as_cbor(UInt16MultiArray(data=[258]))["data"] == cbor2.CBORTag(69, b"\x02\x01")
    assert as_cbor(Int64MultiArray(data=[-2]))["data"] == cbor2.CBORTag(79, struct.pack("<q", -2))
    assert math.isnan(as_cbor(Float64(math.nan))["data"])
    assert as_cbor(Time(genpy.Time(3, 5)))["data"] == {"secs": 3, "nsecs": 5}


@pytest.mark.parametrize("size", [APART - 1, APART, APART + 1, 300_000])
def test_large_arrays_are_the_same_as_small_ones(size: int) -> None:
    picture = Image(encoding="rgb8", data=bytes(size))
    pieces = json_pieces(decode(serialized(picture), Image, JSON))
    assert (len(pieces) > 1) == (size >= APART)
    assert base64.b64decode(as_json(picture)["data"]) == bytes(size)
    assert as_cbor(picture)["data"] == bytes(size)
    assert as_cbor(Float32MultiArray(data=[1.0] * (size // 4)))["data"].value == struct.pack("<f", 1.0) * (size // 4)


def test_a_message_with_two_large_arrays() -> None:
    both = Float64MultiArray(data=[1.0] * APART)
    both.layout.dim = [MultiArrayDimension(label="x" * (2 * APART))]
    assert as_json(both)["data"] == [1.0] * APART
    assert as_cbor(both)["data"].value == struct.pack("<d", 1.0) * APART


@pytest.mark.parametrize("raw", [b"", b"\x05\0\0\0abcd", b"\x01\0\0\0ab", b"\xff\xff\xff\xff"])
def test_bytes_that_are_no_such_message_are_refused(raw: bytes) -> None:
    with pytest.raises(Invalid, match=r"cannot read a message as std_msgs/String"):
        decode(raw, String, JSON)


@pytest.mark.parametrize(
    "raw", [serialized(TFMessage([TransformStamped()]))[:-1], b"\xff\xff\xff\xff", b"\xff\xff\xff\x0f" + bytes(99)]
)
def test_arrays_that_promise_more_than_there_is_are_refused(raw: bytes) -> None:
    with pytest.raises(Invalid, match=r"cannot read a message as tf2_msgs/TFMessage"):
        decode(raw, TFMessage, JSON)


def test_a_string_that_is_no_utf8_is_still_read() -> None:
    assert decode(b"\x02\0\0\0a\xff", String, JSON) == {"data": "a\ufffd"}


@pytest.mark.parametrize(
    ("cls", "given", "packed"),
    [
        (Float32MultiArray, Numbers("<f8", struct.pack("<d", 1.5)), struct.pack("<f", 1.5)),
        (Float32MultiArray, Numbers("<i2", struct.pack("<h", -3)), struct.pack("<f", -3)),
        (Int16MultiArray, Numbers(">i2", struct.pack(">h", -3)), struct.pack("<h", -3)),
        (UInt8MultiArray, Numbers("<u2", struct.pack("<H", 200)), b"\xc8"),
        (UInt8MultiArray, b"\xc8", b"\xc8"),
    ],
)
def test_typed_arrays_of_other_types_are_converted(cls: Any, given: Any, packed: bytes) -> None:
    raw = encode({"data": given}, cls)
    assert raw.endswith(packed)
    assert raw[-len(packed) - 4 : -len(packed)] == b"\x01\0\0\0"


@pytest.mark.parametrize(
    ("cls", "given", "text"),
    [
        (Int16MultiArray, Numbers("<f4", struct.pack("<f", 1.5)), r"\.data: integers are needed, not floats"),
        (UInt8MultiArray, Numbers("<i2", struct.pack("<h", -3)), r"\.data: a number does not fit"),
        (String, Numbers("<i2", b""), r"\.data: a string is needed, not a typed array"),
        (String, b"x", r"\.data: a string is needed, not bytes"),
        (Float32, 1e300, r"\.data: .* does not fit float32"),
        (Int64, 1 << 200, r"\.data: it does not fit int64"),
        (Float64, 1 << 5000, r"\.data: it does not fit float64"),
        (Float32MultiArray, [1.0, 1e300], r"\.data\[1\]: .* does not fit float32"),
        (Float32MultiArray, [1.0, True], r"\.data\[1\]: a number is needed, not a bool"),
        (Float32MultiArray, "AAAA", r"\.data: a list is needed, not a string"),
        (Duration, {"secs": 2**31 - 1, "nsecs": 2**31 - 1}, r"\.data: .* do not fit a duration"),
    ],
)
def test_numbers_that_do_not_fit_are_refused_by_name(cls: Any, given: Any, text: str) -> None:
    with pytest.raises(Invalid, match=text):
        encode({"data": given}, cls)


def test_null_in_an_array_of_floats_is_nan() -> None:
    assert math.isnan(from_json({"data": [1.0, None]}, Float32MultiArray).data[1])
