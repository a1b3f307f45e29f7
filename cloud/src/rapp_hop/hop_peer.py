"""Calls the services of a real Hop server: native Hop, and Hop for Node.js.

Arguments are positional. They go as JSON in the query, which carries all JSON types to every native version; what is long
goes as positional parts, as Hop's own clients send it; node's servers read another query. `Hop-Serialize: json` asks for
JSON; what comes back is read by its content type, and node's by the header `hop-serialize`.
"""

import base64
import re
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote_to_bytes

from tornado.httpclient import HTTPRequest, HTTPResponse
from tornado.simple_httpclient import SimpleAsyncHTTPClient

from rapp_hop import bigloo, strict_json
from rapp_hop.connecting import BY_STATUS, fetch, make_connections
from rapp_hop.errors import Bug, Invalid, Refused
from rapp_hop.uploading import Parcel, pack_multipart

MAX_ANSWER = 16 * 2**20  # bytes
MAX_QUERY = 4096  # bytes of arguments in a URL
_TOKENS = re.compile(r'"(?:[^"\\]|\\.)*"|sc_vector2array|[()]')


class HopPeer:
    """A real Hop server; use it inside a running asyncio loop and `close()` it at the end."""

    def __init__(
        self,
        base_url: str,
        user: str | None = None,
        password: str = "",
        *,
        node: bool = False,
        connect_timeout: float = 5.0,
    ) -> None:
        """Remember where to call.

        :param base_url: such as http://127.0.0.1:8080
        :param user: for Basic authentication
        :param node: it is Hop for Node.js
        :param connect_timeout: seconds
        """
        self.base_url = base_url.rstrip("/")
        self._node = node
        self._connect_timeout = connect_timeout
        self._headers = {"Hop-Serialize": "json", "Hop-Responsetype": "arraybuffer", "Hop-Client": "hop"}
        if user is not None:
            word = base64.b64encode(f"{user}:{password}".encode()).decode("ascii")
            self._headers["Authorization"] = f"Basic {word}"
        self._client: SimpleAsyncHTTPClient | None = None

    async def call(self, service: str, *args: Any, timeout: float = 30.0) -> Any:
        """Call `/hop/<service>` with positional arguments and return its value.

        :param timeout: seconds
        :raises HopError: a leaf by what to do next; Bug carries the message that the service threw
        """
        url = f"{self.base_url}/hop/{quote(service)}"
        values = quote(strict_json.dumps(list(args)), safe="")
        if self._node:
            return await self._send(HTTPRequest(f"{url}?hop-serialize=json-url&hop-arguments={values}"), timeout)
        if not args:
            return await self._send(HTTPRequest(url, "PUT", body=b""), timeout)
        if len(values) <= MAX_QUERY:
            return await self._send(HTTPRequest(f"{url}?hop-encoding=json&vals={values}", "PUT", body=b""), timeout)
        return await self._post(url, _positional(args), timeout)

    async def call_named(self, service: str, args: Mapping[str, str], files: Mapping[str, Path], timeout: float = 30.0) -> Any:
        """Call a service that takes one object: fields of text, and files, of which it gets the server's paths.

        :param timeout: seconds
        :raises HopError: as `call`
        """
        texts = {name: ("text/plain; charset=utf-8", text.encode()) for name, text in args.items()}
        parcel = await pack_multipart(texts, files)
        return await self._post(f"{self.base_url}/hop/{quote(service)}", parcel, timeout)

    async def close(self) -> None:
        """Let go of the connections."""
        if self._client is not None:
            self._client.close()
            self._client = None

    async def _post(self, url: str, parcel: Parcel, timeout: float) -> Any:
        headers = {"Content-Type": parcel.content_type}
        return await self._send(HTTPRequest(url, "POST", headers, await parcel.whole()), timeout)

    async def _send(self, request: HTTPRequest, timeout: float) -> Any:
        request.headers.update(self._headers)
        if self._client is None:
            self._client = make_connections(None, max_clients=64, max_buffer_size=MAX_ANSWER)
        response = await fetch(self._client, request, timeout, self._connect_timeout)
        return _value(request.url.partition("?")[0], response)


def _positional(args: tuple[Any, ...]) -> Parcel:
    boundary = secrets.token_hex(16)
    body = b""
    for value in args:
        kind, data = _part(value)
        head = f'--{boundary}\r\nContent-Disposition: form-data; name="{kind}"\r\nhop-encoding: {kind}\r\n\r\n'
        body += head.encode() + data + b"\r\n"
    body += f"--{boundary}--\r\n".encode()
    return Parcel(f"multipart/form-data; boundary={boundary}", (), body, len(body))


def _part(value: Any) -> tuple[str, bytes]:
    if isinstance(value, str):
        return "string", value.encode()
    if isinstance(value, int) and not isinstance(value, bool):
        return "integer", str(value).encode()
    return "hop", bigloo.dumps(value)


def _value(where: str, response: HTTPResponse) -> Any:
    if response.code in (201, 204, 304):
        return None
    if response.code != 200:
        _fail(where, response)
    mark = response.headers.get("Hop-Serialize", "")
    kind = response.headers.get("Content-Type", "").partition(";")[0].strip().lower()
    if mark in ("string", "html") or (not mark and kind.startswith("text/")):
        return _text(response.body)
    if mark in ("true", "false", "null", "undefined"):
        return {"true": True, "false": False}.get(mark)
    if mark in ("number", "json") or kind == "application/json":
        return strict_json.loads(response.body, limit=MAX_ANSWER)
    match kind:
        case "application/x-hop":
            return _defined(bigloo.loads(response.body, limit=MAX_ANSWER))
        case "application/x-json-hop":
            return _defined(bigloo.loads(_unhex(response.body), limit=MAX_ANSWER))
        case "application/x-url-hop":
            return _defined(bigloo.loads(unquote_to_bytes(response.body), limit=MAX_ANSWER))
        case "application/x-javascript":
            return _from_javascript(_text(response.body))
    return response.body


def _fail(where: str, response: HTTPResponse) -> None:
    if response.code == 500 and "Hop-Error" in response.headers:
        raise Bug(f"cannot call {where}: {_thrown(response.headers['Hop-Error'])}", 500)
    leaf = BY_STATUS.get(response.code, Refused if 300 <= response.code < 500 else Invalid)
    raise leaf(f"cannot call {where}: it answered HTTP {response.code}", response.code)


def _thrown(header: str) -> str:
    """Return the message of an error: a text, or JavaScript's Error as name, message, stack, file and position."""
    value = bigloo.loads(unquote_to_bytes(header))
    if isinstance(value, list) and len(value) > 1:
        value = value[1]
    elif isinstance(value, dict):
        value = value.get("message", value)
    return str(value)[:1000]


def _defined(value: Any) -> Any:
    return None if value is bigloo.UNDEFINED else value


def _unhex(data: bytes) -> bytes:
    try:
        return bytes.fromhex(data.decode("ascii"))
    except (ValueError, UnicodeDecodeError):
        raise Invalid("cannot read the Hop server's answer: it is no hexadecimal text") from None


def _from_javascript(text: str) -> Any:
    """Read the expression that native Hop writes for a value: JSON in parentheses, arrays in calls of sc_vector2array."""
    plain = _TOKENS.sub(lambda found: found[0] if found[0].startswith('"') else "", text)
    return strict_json.loads("null" if plain.strip() == "undefined" else plain, limit=MAX_ANSWER)


def _text(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise Invalid("cannot read the Hop server's answer: it is not UTF-8") from None
