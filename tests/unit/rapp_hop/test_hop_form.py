"""Real Hop's clients, in the bytes that they were recorded to send; and what they must get."""

import json
from pathlib import Path
from typing import Any
from urllib.parse import quote, quote_from_bytes

import pytest

from rapp_hop import bigloo
from rapp_hop.errors import Bug, Invalid, Refused, Unreachable
from rapp_hop.forms import HOP
from rapp_hop.protocol import Call, WireRequest
from rapp_hop.service import Service, service

HEADERS = {"hop-serialize": "x-hop", "hop-responsetype": "arraybuffer", "hop-client": "hop"}
MULTIPART = HEADERS | {"content-type": "multipart/form-data; boundary=ae97aa0384009c0d7f33"}


@service
def add(a: int = 0, b: float = 0, c: str = "", d: list[Any] | None = None, e: Path | None = None) -> None: ...


@service
def take(value: dict[str, Any], more: str = "") -> None: ...


@service
def nothing() -> None: ...


def read(request: WireRequest, item: Service = add) -> Call:
    return HOP.read(request, item)


def part(kind: str, data: bytes) -> bytes:
    head = f'--ae97aa0384009c0d7f33\r\nContent-Disposition: form-data; name="{kind}"\r\nhop-encoding: {kind}\r\n\r\n'
    return head.encode() + data + b"\r\n"


def positional(*parts: tuple[str, bytes]) -> WireRequest:
    body = b"".join(part(kind, data) for kind, data in parts) + b"--ae97aa0384009c0d7f33--\r\n"
    return WireRequest("POST", "/hop/add", MULTIPART, body)


def query(text: str, method: str = "GET", headers: dict[str, str] | None = None) -> WireRequest:
    return WireRequest(method, "/hop/add", HEADERS if headers is None else headers, b"", text)


def test_native_put_without_arguments() -> None:
    assert read(query("", "PUT"), nothing) == Call({}, ())


def test_native_post_as_recorded() -> None:
    request = positional(("integer", b"2"), ("integer", b"3"))
    assert len(request.body) == 226
    assert read(request).arguments == {"a": 2, "b": 3}


def test_native_post_of_every_kind() -> None:
    request = positional(("integer", b"-7"), ("hop", b"f\x01\x033.5"), ("string", "żółw".encode()), ("hop", b"[\x01\x02T."))
    assert read(request).arguments == {"a": -7, "b": 3.5, "c": "żółw", "d": [True, None]}


def test_a_buffer_is_a_file_where_one_is_wanted() -> None:
    octets = b'c\x01\x01XO(\x01\x02\x02\x5b\x13h\x01\x04\x01\x01"\x01\x02u8\x00\x01\xc8\xff\x02\x5b\x13'
    undefined = ("hop", b";")
    call = read(positional(undefined, undefined, undefined, undefined, ("hop", octets)))
    assert call.arguments == {}
    assert [(one.parameter, bytes(one.data)) for one in call.uploads] == [("e", bytes([0, 1, 200, 255]))]


def test_one_object_names_the_arguments_unless_an_object_is_wanted() -> None:
    hashed = b"\x02\xea\xb2"
    value = b"c\x01\x02XO(\x01\x06" + hashed + b':"\x01\x01a\x01\x01:"\x01\x01bXO(\x01\x02' + hashed + b"." + hashed + b"." + hashed
    assert read(positional(("hop", value)), take).arguments == {"value": {"a": 1, "b": {}}}
    assert read(positional(("hop", value))).arguments == {"a": 1, "b": {}}


@pytest.mark.parametrize(
    ("text", "arguments"),
    [
        ("hop-encoding=hop&vals=%28%01%02%22%01%02hi.", {"c": "hi"}),
        ("hop-encoding=hop&vals=.", {}),
        ("hop-encoding=json&vals=" + quote('["hi"]'), {"c": "hi"}),
        ("hop-encoding=json&vals=" + quote('{"whatever": "hi"}'), {"c": "hi"}),
        ("hop-encoding=hopjs&vals=1.S2.hi", {"c": "hi"}),
        ("hop-serialize=json-url&hop-arguments=" + quote('["hi"]'), {"c": "hi"}),
        ("c=hi", {"c": "hi"}),
        ("c=hi&d=x", {"c": "hi", "d": "x"}),
        ("", {}),
    ],
)
def test_queries(text: str, arguments: dict[str, Any]) -> None:
    @service
    def say(c: str = "", d: Any = None) -> None: ...

    for method in ("GET", "PUT"):
        assert read(query(text, method, {}), say).arguments == arguments


def test_plain_queries_are_texts_and_become_what_is_wanted() -> None:
    assert read(query("a=3&b=1.5&c=4&d=x&d=y", headers={})).arguments == {"a": 3, "b": 1.5, "c": "4", "d": ["x", "y"]}


def test_node_client_headers() -> None:
    assert read(query("", "POST", {"hopjs-arguments": "hop-encoding=hopjs&vals=2.I1.1I1.2"})).arguments == {"a": 1, "b": 2}
    assert read(query("", "POST", {"hop-arguments": quote("[1, 2]"), "hop-serialize": "json"})).arguments == {"a": 1, "b": 2}


def test_json_and_form_bodies() -> None:
    def post(kind: str, body: bytes) -> Call:
        return read(WireRequest("POST", "/hop/add", {"content-type": kind, "hop-serialize": "json"}, body))

    assert post("application/json", b"[1, 2]").arguments == {"a": 1, "b": 2}
    assert post("application/json", b'{"a": 1}').arguments == {"a": 1}
    assert post("application/x-www-form-urlencoded", b"a=1&c=x").arguments == {"a": 1, "c": "x"}


def test_named_parts_with_a_file() -> None:
    body = (
        b'--ae97aa0384009c0d7f33\r\nContent-Disposition: form-data; name="c"\r\n\r\nx\r\n'
        b'--ae97aa0384009c0d7f33\r\nContent-Disposition: form-data; name="e"; filename="f.txt"\r\n\r\nF\r\n'
        b"--ae97aa0384009c0d7f33--\r\n"
    )
    call = read(WireRequest("POST", "/hop/add", MULTIPART, body))
    assert call.arguments == {"c": "x"}
    assert [(one.parameter, bytes(one.data), one.suffix) for one in call.uploads] == [("e", b"F", ".txt")]


@pytest.mark.parametrize(
    "request_",
    [
        positional(("integer", b"x")),
        positional(("integer", b"9" * 50)),
        positional(("string", b"\xff")),
        positional(("hop", b"")),
        positional(("hop", b"[\x08\xff\xff\xff\xff\xff\xff\xff\xff")),
        positional(("strange", b"x")),
        positional(*[("integer", b"1")] * 6),
        query("hop-encoding=strange&vals=x"),
        query("hop-encoding=hop&vals=%FF"),
        query("hop-encoding=json&vals=3"),
        query("hop-encoding=hopjs&vals=9.S"),
        query("a=%FF", headers={}),
        query("&".join(f"a{n}=1" for n in range(100)), headers={}),
        WireRequest("POST", "/hop/add", MULTIPART, b"x"),
        WireRequest("POST", "/hop/add", HEADERS | {"content-type": "text/plain"}, b"x"),
    ],
)
def test_h12_broken_arguments_reach_no_service(request_: WireRequest) -> None:
    with pytest.raises(Invalid):
        read(request_)


@pytest.mark.parametrize(
    ("value", "kind", "mark"),
    [
        ("é", "text/plain; charset=UTF-8", "string"),
        ({"a": [1]}, "application/json", "json"),
        ([1], "application/json", "json"),
        (3.5, "application/json", "number"),
        (True, "application/json", "true"),
        (False, "application/json", "false"),
        (None, "application/json", "null"),
    ],
)
def test_answers_every_client_decodes(value: Any, kind: str, mark: str) -> None:
    told = HOP.write(value, add)
    assert (told.status, told.content_type, told.headers) == (200, kind, (("Hop-Serialize", mark),))
    assert isinstance(told.body, bytes)
    assert (told.body.decode() if mark == "string" else json.loads(told.body)) == value


def test_errors() -> None:
    assert dict(HOP.write_error(Refused("cannot x", 401), None).headers)["WWW-Authenticate"].startswith("Basic ")
    bug = HOP.write_error(Bug("cannot x"), add)
    assert (bug.status, dict(bug.headers)["Hop-Error"]) == (500, quote_from_bytes(bigloo.dumps("cannot x")))
    assert HOP.write_error(Unreachable("cannot x", 408), add).status == 408
    assert HOP.write_error(Refused("cannot x", 404), None).status == 404
