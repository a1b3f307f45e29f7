"""The original platform's clients, in the words that they were recorded to send; and what they must get."""

import json
from pathlib import Path
from typing import Any

import pytest

from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.forms import ORIGINAL
from rapp_hop.protocol import Call, WireRequest
from rapp_hop.service import service

FORM = "application/x-www-form-urlencoded"


@service(blank={"results": [], "level": -1})
def ask(
    ontology_class: str = "",
    recursive: bool = False,
    ipaddr: str = "",
    engine: str = "",
    grammar: list[str] | None = None,
    map_name: str = "",
    metric: int = 0,
    file: Path | None = None,
    png_file: Path | None = None,
    yaml_file: Path | None = None,
) -> None: ...


def read(body: bytes, kind: str = "", method: str = "POST", query: str = "") -> Call:
    headers = {"content-type": kind} if kind else {}
    return ORIGINAL.read(WireRequest(method, "/hop/ask", headers, body, query), ask)


OVEN = {"ontology_class": "Oven", "recursive": False}


@pytest.mark.parametrize(
    ("body", "kind", "arguments"),
    [
        # Python, no file
        (b"json=%7B%22ontology_class%22%3A+%22Oven%22%2C+%22recursive%22%3A+false%7D", FORM, OVEN),
        (b"json=%7B%7D", FORM, {}),
        # JavaScript: no content type, JSON as it is
        (b'json={"ipaddr":"104.16.115.182","engine":"ip-api"}', "", {"ipaddr": "104.16.115.182", "engine": "ip-api"}),
        (b'json={"ontology_class":"a+b & 100% %41"}', "", {"ontology_class": "a+b & 100% %41"}),
        (b'json={"ontology_class":"a+b & 100% %41"}', FORM, {"ontology_class": "a+b & 100% %41"}),
        (b"", "", {}),
        (b"", FORM, {}),
        # C++: a blank line and then bare JSON as a form
        (b'\r\n{"ontology_class":"Oven","recursive":false}', FORM, OVEN),
        (b'{"ontology_class":"Oven","recursive":false}\r\n', "", OVEN),
        # an argument that is not known, an older client's user, an empty text for an empty list
        (b'json={"user":"rapp","ontology_class":"Oven","grammar":""}', FORM, {"ontology_class": "Oven", "grammar": []}),
        # loose fields
        (b"map_name=home&metric=1&json=%7B%22engine%22%3A%22x%22%7D", FORM, {"map_name": "home", "metric": 1, "engine": "x"}),
    ],
)
def test_forms_without_files(body: bytes, kind: str, arguments: dict[str, Any]) -> None:
    assert read(body, kind).arguments == arguments


def test_cpp_get_with_a_body_of_a_line_end() -> None:
    assert read(b"\r\n", method="GET") == Call({}, ())


def parts(*lines: bytes) -> bytes:
    return b"".join(lines)


CPP = "multipart/form-data; boundary=HYrj65hy4VYNr8CM"


def test_cpp_multipart_with_a_lone_lf_before_the_boundary() -> None:
    body = parts(
        b"--HYrj65hy4VYNr8CM\r\n",
        b'Content-Disposition: form-data; name="json"\r\n\r\n',
        b'{"ontology_class":"Oven","recursive":false}\n',
        b"--HYrj65hy4VYNr8CM--\r\n",
    )
    assert len(body) == 133  # as recorded
    assert read(body, CPP).arguments == OVEN


def test_cpp_multipart_without_end() -> None:
    body = b'--HYrj65hy4VYNr8CM\r\nContent-Disposition: form-data; name="json"\r\n\r\n{"ipaddr":"::1"}\n\r\n'
    assert read(body, CPP).arguments == {"ipaddr": "::1"}


def test_cpp_file_after_json() -> None:
    body = parts(
        b'--HYrj65hy4VYNr8CM\r\nContent-Disposition: form-data; name="json"\r\n\r\n{"recursive":true}\n',
        b'--HYrj65hy4VYNr8CM\r\nContent-Disposition: form-data; name="file"; filename="a.png"\r\n',
        b"Content-Type: image/png\r\nContent-Transfer-Encoding: binary\r\n\r\n\x89PNG\n\0\r\n",
        b"--HYrj65hy4VYNr8CM--\r\n",
    )
    call = read(body, CPP)
    assert call.arguments == {"recursive": True}
    assert [(one.parameter, bytes(one.data), one.suffix) for one in call.uploads] == [("file", b"\x89PNG\n\0", ".png")]


def test_python_file_without_content_type() -> None:
    body = parts(
        b'--b1\r\nContent-Disposition: form-data; name="json"\r\n\r\n{"recursive": false}\r\n',
        b'--b1\r\nContent-Disposition: form-data; name="file"; filename="qr_code_rapp-bbPczX6.jpg"\r\n\r\n\xff\xd8\r\n',
        b"--b1--\r\n",
    )
    call = read(body, "multipart/form-data; boundary=b1")
    assert call.arguments == {"recursive": False}
    assert (bytes(call.uploads[0].data), call.uploads[0].suffix) == (b"\xff\xd8", ".jpg")


def test_javascript_file_without_json() -> None:
    boundary = "--------------------------012745678901234567890123"
    body = parts(
        f"--{boundary}\r\n".encode(),
        b'Content-Disposition: form-data; name="file"; filename="x.png"\r\nContent-Type: image/png\r\n\r\n\x89PNG\r\n',
        f"--{boundary}--\r\n".encode(),
    )
    call = read(body, f"multipart/form-data; boundary={boundary}")
    assert (call.arguments, bytes(call.uploads[0].data)) == ({}, b"\x89PNG")


def test_cpp_map_upload_has_loose_parts_and_two_files() -> None:
    body = parts(
        b'--b\r\nContent-Disposition: form-data; name="map_name"\r\n\r\nhome\r\n',
        b'--b\r\nContent-Disposition: form-data; name="png_file"; filename="home.png"\r\n\r\nP\r\n',
        b'--b\r\nContent-Disposition: form-data; name="yaml_file"; filename="home.yaml"\r\n\r\nY\r\n--b--\r\n',
    )
    call = read(body, "multipart/form-data; boundary=b")
    assert call.arguments == {"map_name": "home"}
    assert [one.parameter for one in call.uploads] == ["png_file", "yaml_file"]


@pytest.mark.parametrize("body", [b"json={", b'json=["x"]', b"json=1", b"json=%FF", b'json={"ontology_class":NaN}'])
def test_h12_json_that_is_none_reaches_no_service(body: bytes) -> None:
    with pytest.raises(Invalid):
        read(body, FORM)


def answer(error: HopError, found: bool = True) -> tuple[int, str, bytes]:
    told = ORIGINAL.write_error(error, ask if found else None)
    assert isinstance(told.body, bytes)
    return told.status, told.content_type.partition(";")[0], told.body


def test_answers_are_objects_with_an_error() -> None:
    told = ORIGINAL.write({"results": ["x"]}, ask)
    assert isinstance(told.body, bytes)
    assert (told.status, told.content_type, json.loads(told.body)) == (
        200,
        "application/json",
        {"error": "", "results": ["x"]},
    )
    plain = ORIGINAL.write(3, ask)
    assert isinstance(plain.body, bytes)
    assert json.loads(plain.body) == {"error": "", "result": 3}


def test_a_service_s_failure_is_still_200_with_empty_defaults() -> None:
    for error in (Refused("cannot x"), Invalid("cannot x")):
        status, kind, body = answer(error)
        assert (status, kind, json.loads(body)) == (200, "application/json", {"results": [], "level": -1, "error": "cannot x"})


def test_the_platform_s_own_failures_are_its_text_pages() -> None:
    assert answer(Refused("cannot x", 401), found=False) == (401, "text/plain", b"Authentication Failure")
    assert answer(Bug("cannot x")) == (500, "text/plain", b"Server Error")
    assert answer(Unreachable("cannot x", 408)) == (500, "text/plain", b"Server Error")
    assert answer(Refused("cannot x", 404), found=False) == (404, "text/plain", b"This service is unknown!")
