"""Our own form as bytes: what comes in is read or refused, never guessed (H07, H11, H12)."""

import json
from pathlib import Path
from typing import Any

import pytest

from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable, from_wire
from rapp_hop.forms import OWN, form_of
from rapp_hop.multipart import parse_multipart, parse_options
from rapp_hop.protocol import Call, WireRequest
from rapp_hop.service import service


@service
def x(a: int = 0, b: str = "", f: Path | None = None, recording: Path | None = None) -> None: ...


def read(request: WireRequest) -> Call:
    assert form_of(request.method, {**request.headers, "accept": "application/json"}) is OWN
    return OWN.read(request, x)


def post(body: bytes, kind: str = "application/json", method: str = "POST") -> WireRequest:
    return WireRequest(method, "/hop/x", {"content-type": kind}, body)


def multipart(*parts: tuple[str, bytes]) -> WireRequest:
    body = b"".join(
        b"--B\r\nContent-Disposition: form-data; " + head.encode() + b"\r\n\r\n" + data + b"\r\n" for head, data in parts
    )
    return post(body + b"--B--\r\n", "multipart/form-data; boundary=B")


def test_json_call() -> None:
    request = post(b'{"a": 1, "b": "\xc3\xa9"}', "application/json; charset=utf-8")
    assert read(request).arguments == {"a": 1, "b": "é"}


def test_no_body_means_no_arguments() -> None:
    assert read(post(b"")).arguments == {}


def test_multipart_with_file_whose_bytes_look_like_anything() -> None:
    data = b"\r\n--BC\r\n\0\xff--B"
    call = read(multipart(('name="json"', b'{"a":1}'), ('name="recording"; filename="../../etc/x.OGG"', data)))
    assert call.arguments == {"a": 1}
    assert (call.uploads[0].parameter, call.uploads[0].data, call.uploads[0].suffix) == ("recording", data, ".ogg")


@pytest.mark.parametrize("name", ["x", "x.", "x.toolongsuffix", "x.o/g", "x.é"])
def test_of_a_file_name_only_a_plain_suffix_is_kept(name: str) -> None:
    call = read(multipart((f'name="f"; filename="{name}"', b"")))
    assert call.uploads[0].suffix == ""


@pytest.mark.parametrize(
    "body",
    [
        b"{",
        b"[]",
        b'"x"',
        b"1",
        b"null",
        b'{"a":1}{"b":2}',
        b'{"a":1,"a":2}',
        b'{"a":NaN}',
        b'{"a":1e400}',
        b"\xff",
        b"[" * 99999,
        b'{"a":"\\udc00"}',
    ],
)
def test_h12_bad_json(body: bytes) -> None:
    with pytest.raises(Invalid, match="cannot read"):
        read(post(body))


@pytest.mark.parametrize(
    "request_",
    [post(b"{}", "text/plain"), post(b"{}", "application/jsonp"), post(b"{}", "application/json, text/plain")],
)
def test_h11_wrong_type(request_: WireRequest) -> None:
    with pytest.raises(Invalid, match="POST application/json"):
        form_of(request_.method, request_.headers)


@pytest.mark.parametrize("method", ["DELETE", "PATCH", "OPTIONS", "post"])
def test_h11_wrong_method(method: str) -> None:
    with pytest.raises(Refused) as caught:
        form_of(method, {"content-type": "application/json"})
    assert caught.value.status == 405


def test_h11_other_charset() -> None:
    with pytest.raises(Invalid, match="UTF-8"):
        read(post(b"{}", "application/json; charset=utf-16"))


@pytest.mark.parametrize(
    "request_",
    [
        multipart(('name="a"', b"1")),
        multipart(('filename="x"', b"1")),
        multipart(('name="json"', b'{"f":1}'), ('name="f"; filename="x"', b"")),
        multipart(('name="f"; filename="x"', b""), ('name="f"; filename="y"', b"")),
        multipart(*[('name="f"; filename="x"', b"")] * 40),
        multipart((f'name="{"n" * 300}"', b"")),
        multipart(('name="f"; x="' + "y" * 200 + '"; z="' + "y" * 200 + '"; ' * 9, b"")),
        post(b"--B\r\n", "multipart/form-data; boundary=B"),
        post(b"", "multipart/form-data; boundary=B"),
        post(b"--B--\r\n", "multipart/form-data"),
        post(b"--B\r\nno headers--B--", "multipart/form-data; boundary=B"),
        post(b"--\r\n", 'multipart/form-data; boundary=""'),
    ],
)
def test_h07_bad_multipart(request_: WireRequest) -> None:
    with pytest.raises(Invalid, match="cannot read"):
        read(request_)


def test_options_of_a_header() -> None:
    assert parse_options('Form-Data; name="a b;c"; X=y') == ("form-data", {"name": "a b;c", "x": "y"})
    with pytest.raises(Invalid):
        parse_options("form-data; name=a; name=b")


def test_parts_keep_their_order() -> None:
    found = parse_multipart(multipart(('name="b"', b"1"), ('name="a"', b"2"), ('name="b"', b"")).body, "B")
    assert [(part.name, part.data) for part in found] == [("b", b"1"), ("a", b"2"), ("b", b"")]


@pytest.mark.parametrize("value", [None, True, 3, 1.5, "é\n", [1, {"a": []}], {"a": None}])
def test_results_are_bare_json(value: Any) -> None:
    answer = OWN.write(value, x)
    assert (answer.status, answer.content_type) == (200, "application/json")
    assert isinstance(answer.body, bytes)
    assert json.loads(answer.body) == value


@pytest.mark.parametrize("value", [float("nan"), b"x", object(), {1: object()}])
def test_results_that_json_has_not(value: Any) -> None:
    with pytest.raises(Bug, match="not JSON"):
        OWN.write(value, x)


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (Refused("cannot x"), 403),
        (Invalid("cannot x"), 400),
        (Unreachable("cannot x"), 503),
        (Bug("cannot x"), 500),
        (Refused("cannot x", 404), 404),
        (Refused("cannot x", 299), 403),
    ],
)
def test_errors_travel_and_come_back_as_themselves(error: HopError, status: int) -> None:
    answer = OWN.write_error(error, None)
    assert answer.status == status
    assert isinstance(answer.body, bytes)
    said = json.loads(answer.body)["error"]
    back = from_wire(said["kind"], said["message"])
    assert (type(back), str(back)) == (type(error), "cannot x")


def test_an_unknown_kind_is_a_bug_of_the_sender() -> None:
    assert type(from_wire("strange", "x")) is Bug
