"""Bad input, H07 to H12 of the project's list of hostile inputs: parts, paths, methods, types, JSON and arguments.

Each case gets its status and message, reaches no service, and harms no other request: another caller is served meanwhile and
afterwards, and the neighbour before it on the same connection has its answer.
"""

import json
import time
from pathlib import Path
from typing import Any

import pytest

from fakes.bad_requests import MULTIPART, PART, invalid
from fakes.hop_house import House, read_answers, request, visit
from rapp_hop.server import ServerLimits
from rapp_hop.service import service


def many_parts(count: int) -> bytes:
    return PART * count + b"--B--\r\n"


@pytest.mark.parametrize(
    "body",
    [
        many_parts(10_000),
        b"--B\r\nX: " + b"y" * 10_000 + b"\r\n\r\n\r\n--B--\r\n",
        PART,
        b"--B--\r\n--B--\r\n",
        b"",
        b"\0" * 1000,
        b'--B\r\nContent-Disposition: form-data; name="file"; filename="x"; name="y"\r\n\r\n\r\n--B--\r\n',
        b'--B\r\nContent-Disposition: form-data; name="other"; filename="x"\r\n\r\n\r\n--B--\r\n',
    ],
)
def test_h07_multipart_of_too_many_or_wrong_parts(tmp_path: Path, body: bytes) -> None:
    async def test(house: House) -> None:
        await invalid(house, body, MULTIPART)
        assert not (house.folder / "uploads").exists() or not list((house.folder / "uploads").iterdir())

    visit(test, tmp_path)


def test_h08_a_flood_of_malformed_multipart_is_no_flood_of_the_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    async def test(house: House) -> None:
        caplog.set_level("INFO")
        began = time.monotonic()
        data = request("/hop/measure", b"--B\r\n", "Accept: application/json", kind=MULTIPART, keep=True)
        answers = read_answers(await house.send(data * 300 + request()))
        assert [answer.status for answer in answers] == [400] * 300 + [200]
        lines = [record for record in caplog.records if record.name.startswith("rapp_hop")]
        assert len(lines) <= 5 * (time.monotonic() - began + 2)  # five for each second that it took
        assert len(lines) + house.server.brake.held_back == 300
        assert house.ran == 1

    visit(test, tmp_path, limits=ServerLimits(log_lines=5))


def test_h09_cookies_are_not_read(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        cookie = 'Cookie: a="' + "\\\\" * 7000 + '"'
        assert (await house.ask(request("/hop/echo", b'{"value": 1}', cookie))).status == 200

    visit(test, tmp_path)


@pytest.mark.parametrize(
    "path",
    ["/hop/../echo", "/hop/%2e%2e/echo", "/hop/%252e%252e/x", "/hop/echo%00", "/hop//echo", "/hop/-/../page.js", "/hop/-/%2e%2e/x",
     "/hop/-/page.js%00", "/hop/-/", "/etc/passwd", "//etc/passwd", "/hop/ECHO", "/hop/echo/more", "/hop/__class__"],
)  # fmt: skip
def test_h10_paths_lead_nowhere_else(tmp_path: Path, path: str) -> None:
    async def test(house: House) -> None:
        for method in ("POST", "GET"):
            answer = await house.ask(request(path, b"{}" if method == "POST" else b"", method=method, kind="application/json"))
            assert (answer.status, answer.json["error"]["kind"]) == (404, "refused")
        assert house.ran == 0

    visit(test, tmp_path)


@pytest.mark.parametrize(
    ("status", "method", "kind"),
    [
        (405, "DELETE", "application/json"),
        (405, "PATCH", "application/json"),
        (405, "OPTIONS", ""),
        (400, "POST", "text/plain"),
        (400, "POST", "application/xml"),
        (400, "POST", "application/json; charset=utf-16"),
        (400, "POST", "application/json; charset"),
        (400, "POST", "multipart/mixed; boundary=B"),
    ],
)
def test_h11_wrong_method_type_or_charset(tmp_path: Path, status: int, method: str, kind: str) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(request("/hop/echo", b'{"value": 1}', method=method, kind=kind))
        assert (answer.status, answer.json["error"]["message"][:7]) == (status, "cannot ")
        assert house.ran == 0

    visit(test, tmp_path)


BODIES = [
    b"\xff\xfe",
    b'{"value": "\\ud800"}',
    b'{"value": 1e400}',
    b'{"value": NaN}',
    b'{"value": Infinity}',
    b'{"value": ' + b"9" * 1_000_000 + b"}",
    b"[" * 100_000 + b"]" * 100_000,
    b'{"value":' * 50_000 + b"1" + b"}" * 50_000,
    b'{"value": 1, "value": 2}',
    b'{"value": {"a": 1, "a": 2}}',
    b"[]",
    b"null",
    b'"value"',
    b"{",
    b'{"value": 1}{"value": 2}',
    b"",
    b'{"value": 1, "more": 2}',
    b'{"Value": 1}',
]


@pytest.mark.parametrize("body", BODIES)
def test_h12_json_that_breaks_a_rule(tmp_path: Path, body: bytes) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(request("/hop/echo", body))
        assert (answer.status, answer.json["error"]["kind"]) == (400, "invalid")
        assert len(answer.body) < 1000  # no echo of what was sent
        assert house.ran == 0 and await house.alive()

    visit(test, tmp_path)


@pytest.mark.parametrize(
    "arguments", [{"a": "1"}, {"a": True}, {"a": 1.5}, {"a": None}, {"a": [1]}, {"b": 1}, {"a": 1, "c": 1}, {}]
)
def test_h12_wrong_missing_and_extra_arguments(tmp_path: Path, arguments: dict[str, Any]) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(request("/hop/add", json.dumps(arguments).encode()))
        assert (answer.status, answer.json["error"]["kind"], house.ran) == (400, "invalid", 0)

    visit(test, tmp_path)


def test_h12_a_number_too_large_for_a_float(tmp_path: Path) -> None:
    @service
    def half(value: float) -> float:
        raise AssertionError("must not run")

    async def test(house: House) -> None:
        assert (await house.ask(request("/hop/half", b'{"value": 1' + b"0" * 400 + b"}"))).status == 400

    visit(test, tmp_path, half)
