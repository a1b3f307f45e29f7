"""Clients of the original platform and of real Hop, byte by byte as they were recorded, on real connections."""

import asyncio
import base64
import json
from pathlib import Path
from urllib.parse import quote

import pytest

from fakes.hop_house import FORM, OTHER, TOKEN, House, request, visit
from rapp_hop.service import service

NATIVE = "connection: close\r\nhop-serialize: x-hop\r\nhop-responsetype: arraybuffer\r\nhop-client: hop\r\n"


def native(line: str, body: bytes = b"", more: str = "") -> bytes:
    head = f"{line} HTTP/1.1\r\nHost: 127.0.0.1:12120\r\n{NATIVE}Accept-Token: {TOKEN}\r\n{more}"
    return (head + (f"Content-Length: {len(body)}\r\n" if body else "") + "\r\n").encode() + body


def positional(*values: tuple[str, str]) -> bytes:
    head = '--ae97\r\nContent-Disposition: form-data; name="{0}"\r\nhop-encoding: {0}\r\n\r\n{1}\r\n'
    return ("".join(head.format(*value) for value in values) + "--ae97--\r\n").encode()


MULTIPART = "Content-Type: multipart/form-data; boundary=ae97\r\n"


@pytest.mark.parametrize("half_close", [True, False])
def test_native_hop_closes_its_sending_half_and_gets_its_answer(tmp_path: Path, half_close: bool) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(native("PUT /hop/who"), half_close)
        assert (answer.status, answer.headers["content-type"], answer.body) == (200, "text/plain; charset=UTF-8", b"nao PUT")
        body = positional(("integer", "2"), ("integer", "3"))
        answer = await house.ask(native("POST /hop/add", body, MULTIPART), half_close)
        assert (answer.json, answer.headers["hop-serialize"]) == (5, "number")
        answer = await house.ask(native("PUT /hop/broken"), half_close)
        assert (answer.status, "hop-error" in answer.headers, b"secret" in answer.body) == (500, True, False)
        assert (await house.ask(native("PUT /hop/nix"), half_close)).status == 404

    visit(test, tmp_path)


def test_a_slow_service_answers_a_half_closed_connection(tmp_path: Path) -> None:
    @service
    async def slow() -> str:
        await asyncio.sleep(0.5)
        return "late"

    async def test(house: House) -> None:
        answers = await asyncio.gather(*(house.ask(native("PUT /hop/slow"), half_close=True) for _ in range(8)))
        assert [answer.body for answer in answers] == [b"late"] * 8

    visit(test, tmp_path, slow)


def test_browser_and_node_generations_of_hop(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        for text in (
            "hop-encoding=hop&vals=%28%01%02%22%01%02hi.",
            "hop-encoding=hopjs&vals=1.S2.hi",
            "hop-encoding=json&vals=" + quote('["hi"]'),
            "hop-serialize=json-url&hop-arguments=" + quote('["hi"]'),
            "value=hi",
        ):
            for method in ("GET", "PUT"):
                answer = await house.ask(request(f"/hop/echo?{text}", b"", method=method, kind=""))
                assert (answer.status, answer.body, answer.headers["hop-serialize"]) == (200, b"hi", "string")
        answer = await house.ask(request("/hop/add", b"", "Hopjs-Arguments: hop-encoding=hopjs&vals=2.I1.1I1.2", kind=""))
        assert (answer.json, answer.headers["hop-serialize"]) == (3, "number")
        head = await house.send(request("/hop/add", b"", method="HEAD", kind=""))
        assert head.startswith(b"HTTP/1.1 200 ") and head.endswith(b"\r\n\r\n")

    visit(test, tmp_path)


def test_hop_s_basic_authentication(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        word = base64.b64encode(f"anybody:{OTHER}".encode()).decode()
        answer = await house.ask(request("/hop/who", b"", f"Authorization: Basic {word}", method="PUT", kind="", token=""))
        assert answer.body == b"ann PUT"
        answer = await house.ask(request("/hop/who", b"", method="PUT", kind="", token=""))
        assert (answer.status, answer.headers["www-authenticate"]) == (401, 'Basic realm="hop"')

    visit(test, tmp_path)


def python(service: str, body: bytes, kind: str) -> bytes:
    lines = ("Connection: close", "Accept-Encoding: gzip, deflate", "Accept: */*", "user-agent: rapp-platform-api/python")
    return request(f"/hop/{service}", body, *lines, kind=kind, keep=True)


def test_original_clients(tmp_path: Path) -> None:
    files = (
        b'--b\r\nContent-Disposition: form-data; name="json"\r\n\r\n{"label": "x"}\r\n'
        b'--b\r\nContent-Disposition: form-data; name="file"; filename="qr-bbPcz.jpg"\r\n\r\n12345\r\n--b--\r\n'
    )
    cpp = (
        b'--b\r\nContent-Disposition: form-data; name="json"\r\n\r\n{"label":"x"}\n'
        b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.jpg"\r\n'
        b"Content-Type: image/jpeg\r\nContent-Transfer-Encoding: binary\r\n\r\n12345\r\n--b--\r\n"
    )
    measured = {"error": "", "size": 5, "suffix": ".jpg", "label": "x"}

    async def test(house: House) -> None:
        cases = [
            (python("add", b"json=%7B%22a%22%3A+2%2C+%22b%22%3A+3%7D", FORM), {"error": "", "result": 5}),
            (python("measure", files, "multipart/form-data; boundary=b"), measured),
            (request("/hop/add/", b'json={"a":2,"b":3}', kind=""), {"error": "", "result": 5}),
            (request("/hop/measure/", files, kind="multipart/form-data; boundary=b"), measured),
            (request("/hop/measure", cpp, "User-Agent: rapp_api/cpp/0.6.0", kind="multipart/form-data; boundary=b"), measured),
            (request("/hop/add", b'\r\n{"a":2,"user":"rapp"}', kind=FORM), {"error": "", "result": 3}),
        ]
        for data, expected in cases:
            answer = await house.ask(data)
            assert (answer.status, answer.headers["connection"], answer.json) == (200, "close", expected)
        answer = await house.ask(
            request("/hop/available_services", b"\r\n", "User-Agent: rapp_api/cpp/0.6.0", method="GET", kind="")
        )
        listed = {one["name"]: one["url"] for one in answer.json["services"]}
        assert answer.json["error"] == "" and listed["add"] == "/hop/add"

    visit(test, tmp_path)


def test_original_clients_get_errors_as_they_know_them(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(python("add", b"json=%7B%22a%22%3A+%22x%22%7D", FORM))
        assert answer.status == 200 and "must be a whole number" in answer.json["error"]
        answer = await house.ask(python("measure", b"json=%7B%7D", FORM))
        assert answer.status == 200 and answer.json["size"] == -1 and "missing" in answer.json["error"]
        answer = await house.ask(python("broken", b"json=%7B%7D", FORM))
        assert (answer.status, answer.body) == (500, b"Server Error")
        answer = await house.ask(python("nix", b"json=%7B%7D", FORM))
        assert answer.status == 404 and b"This service is unknown!" in answer.body
        answer = await house.ask(request("/hop/add", b"json={}", kind=FORM, token="x" * 20))
        assert (answer.status, answer.body) == (401, b"Authentication Failure")

    visit(test, tmp_path)


def test_the_same_call_in_three_forms_has_the_same_result(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        own = await house.ask(request("/hop/add", b'{"a": 2}'))
        original = await house.ask(request("/hop/add", b'json={"a": 2}', kind=""))
        hop = await house.ask(native("PUT /hop/add?hop-encoding=json&vals=%5B2%5D"))
        assert [own.json, original.json["result"], hop.json] == [3, 3, 3]
        assert house.ran == 3
        # Own JSON is never read as a form, nor a form as JSON.
        assert (await house.ask(request("/hop/add", b'json={"a": 2}'))).status == 400
        assert json.loads((await house.ask(request("/hop/echo", b'{"value": "json={}"}'))).body) == "json={}"

    visit(test, tmp_path)
