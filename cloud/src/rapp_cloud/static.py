"""The store's files over HTTP: `/tuf/metadata/<file>` and `/tuf/targets/<file>`, nothing above or below."""

import asyncio
import re
from collections.abc import AsyncGenerator
from pathlib import Path

from rapp_hop.errors import Refused
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer
from rapp_hop.results import ANY_TYPE

PIECE = 256 * 1024  # bytes
_RANGE = re.compile(r"bytes=(\d{1,18})-", re.ASCII)  # the rest of a file; other ranges get the whole (RFC 9110 section 14.2)
_NAME = re.compile(r"[0-9A-Za-z][0-9A-Za-z._-]{0,200}", re.ASCII)  # no separator, no dot first


def store_files(prefix: str, folder: Path) -> Mount:
    """Serve a folder's files, to be read only and by everybody; who verifies asks for the newest, so nothing is cached."""

    async def send(visit: Visit) -> WireAnswer:
        path = folder / visit.rest
        if not _NAME.fullmatch(visit.rest) or not await asyncio.to_thread(path.is_file):
            raise Refused("cannot find this file in the store: see /hop/list_rapps", 404)
        if path.suffix == ".json":
            return WireAnswer(200, "application/json", path)
        wanted = _RANGE.fullmatch(visit.request.headers.get("range", "")) if visit.request.method == "GET" else None
        if wanted is None:
            return WireAnswer(200, ANY_TYPE, path, (("Accept-Ranges", "bytes"),))
        return _rest(path, int(wanted[1]), (await asyncio.to_thread(path.stat)).st_size)

    return Mount(prefix, send, public=True, methods=frozenset({"GET", "HEAD"}))


def _rest(path: Path, start: int, size: int) -> WireAnswer:
    """Packages never change under their names, so the rest of one fits what somebody has of it."""
    if start >= size:
        return WireAnswer(416, ANY_TYPE, b"", (("Content-Range", f"bytes */{size}"),))
    return WireAnswer(206, ANY_TYPE, _pieces(path, start), (("Content-Range", f"bytes {start}-{size - 1}/{size}"),))


async def _pieces(path: Path, start: int) -> AsyncGenerator[bytes, None]:
    with await asyncio.to_thread(path.open, "rb") as file:
        file.seek(start)
        while piece := await asyncio.to_thread(file.read, PIECE):
            yield piece
