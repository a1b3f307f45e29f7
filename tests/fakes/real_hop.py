"""A server that answers as real Hop was recorded to: native 3.4, and Hop for Node.js where it is asked so.

It reads a request as Hop does (the JSON query, positional parts), closes after every answer, sends no Content-Length with
JSON, and marks its answers as Hop does.
"""

import asyncio
import json
import re
from typing import Any
from urllib.parse import unquote

HASH = b"\x02\xea\xb2"
OBJECT = b"c\x01\x01XO(\x01\x04" + HASH + b':"\x01\x01a\x01\x01.' + HASH  # {a: 1}
ERROR = b"XO(\x01\x03" + HASH + b'[\x01\x05"\x01\x05Error"\x01\x05wrong..\x00.' + HASH  # new Error("wrong")
COMMON = "Server: Hop\r\nCache-Control: no-cache\r\nPragma: no-cache\r\n"


class RealHop:
    """Listens while the block runs; `requests` holds what came."""

    def __init__(self) -> None:
        self.requests: list[tuple[str, dict[str, str], bytes]] = []

    async def __aenter__(self) -> "RealHop":
        self._server = await asyncio.start_server(self._answer, "127.0.0.1", 0)
        self.url = f"http://127.0.0.1:{self._server.sockets[0].getsockname()[1]}"
        return self

    async def __aexit__(self, *_: object) -> None:
        self._server.close()
        await self._server.wait_closed()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1")
        first, *lines = head.strip().split("\r\n")
        headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
        body = await reader.readexactly(int(headers.get("content-length", "0")))
        self.requests.append((first, headers, body))
        writer.write(self._reply(first, headers, body))
        await writer.drain()
        writer.close()

    def _reply(self, first: str, headers: dict[str, str], body: bytes) -> bytes:
        method, target, _ = first.split(" ")
        path, _, query = target.partition("?")
        args = _arguments(query, headers, body)
        if path == "/hop/secret" and headers.get("authorization") != "Basic aHVnbzpwdw==":
            text = b'User "anonymous" is not allowed to execute service "secret".'
            return b'HTTP/1.0 401 Unauthorized\r\nWWW-Authenticate: Basic realm="Basic hop authentication"\r\n\r\n' + text
        service = getattr(self, "_" + path.removeprefix("/hop/"), None)
        if service is None or method not in ("GET", "PUT", "POST"):
            return b"HTTP/1.1 404 Not Found\r\nContent-Type: text/html\r\n\r\n<html>unbound service</html>"
        found: bytes = service(headers, args)
        return found

    def _echo(self, headers: dict[str, str], args: list[Any]) -> bytes:
        return _value(args, headers)

    def _first(self, headers: dict[str, str], args: list[Any]) -> bytes:
        return _value(args[0], headers)

    def _secret(self, headers: dict[str, str], args: list[Any]) -> bytes:
        return _value("told", headers)

    def _binary(self, headers: dict[str, str], args: list[Any]) -> bytes:
        return _ok("application/x-hop; charset=UTF-8", OBJECT)

    def _hexadecimal(self, headers: dict[str, str], args: list[Any]) -> bytes:
        return _ok("application/x-json-hop", OBJECT.hex().encode())

    def _javascript(self, headers: dict[str, str], args: list[Any]) -> bytes:
        return _ok("application/x-javascript; charset=UTF-8", b'({"x":"(hi)","l":sc_vector2array([1,sc_vector2array([])])})')

    def _throws(self, headers: dict[str, str], args: list[Any]) -> bytes:
        return _ok("text/html", b"<html><pre>wrong</pre></html>", "500 Internal Server Error")

    def _rejects(self, headers: dict[str, str], args: list[Any]) -> bytes:
        escaped = "".join(f"%{byte:02x}" for byte in ERROR)
        return _ok("application/x-hop", ERROR, "500 Internal Server Error", f"Hop-Error: {escaped}\r\n")

    def _node(self, headers: dict[str, str], args: list[Any]) -> bytes:
        mark = {"s": "string", "n": "number", "j": "json", "t": "true", "z": "null", "u": "undefined"}[args[0]]
        text = {"s": "hé", "n": "1.5", "j": '{"a":[]}', "t": "true", "z": "null", "u": ""}[args[0]].encode()
        return _ok("text/whatever", text, more=f"hop-serialize: {mark}\r\nContent-Length: {len(text)}\r\n")

    def _rubbish(self, headers: dict[str, str], args: list[Any]) -> bytes:
        return _ok("application/x-hop", b"\xff\xff")


def _value(value: Any, headers: dict[str, str]) -> bytes:
    if isinstance(value, str):
        data = value.encode()
        return _ok("text/plain; charset=UTF-8", data, more=f"Content-Length: {len(data)}\r\n")
    assert headers["hop-serialize"] == "json"
    return _ok("application/json; charset=UTF-8", json.dumps(value, indent=2).encode())


def _ok(kind: str, body: bytes, status: str = "200 Ok", more: str = "") -> bytes:
    return f"HTTP/1.1 {status}\r\n{COMMON}Content-Type: {kind}\r\n{more}Connection: close\r\n\r\n".encode() + body


def _arguments(query: str, headers: dict[str, str], body: bytes) -> list[Any]:
    fields = dict(field.partition("=")[::2] for field in query.split("&") if field)
    spelled = fields.get("vals") if fields.get("hop-encoding") == "json" else fields.get("hop-arguments")
    if spelled is not None:
        return list(json.loads(unquote(spelled)))
    boundary = re.search(r"boundary=(\S+)", headers.get("content-type", ""))
    if boundary is None:
        return []
    return [_part(part) for part in body.split(f"--{boundary[1]}".encode())[1:-1]]


def _part(part: bytes) -> Any:
    head, _, data = part.strip(b"\r\n").partition(b"\r\n\r\n")
    kind = re.search(rb"hop-encoding: (\w+)", head)
    if kind is None:
        return data.decode()  # named form: a field, or a file
    return int(data) if kind[1] == b"integer" else data.decode() if kind[1] == b"string" else data.hex()
