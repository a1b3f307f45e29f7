"""The store's files over HTTP: `/tuf/metadata/<file>` and `/tuf/targets/<file>`, nothing above or below."""

import asyncio
import errno
import os
import re
import stat
from pathlib import Path

from rapp_hop.errors import Refused, Unreachable
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import OpenFile, WireAnswer
from rapp_hop.results import ANY_TYPE

_RANGE = re.compile(r"bytes=(\d{1,18})-", re.ASCII)  # the rest of a file; other ranges get the whole (RFC 9110 section 14.2)
_NAME = re.compile(r"[0-9A-Za-z][0-9A-Za-z._-]{0,200}", re.ASCII)  # no separator, no dot first
_KNOWN = 4096  # files
_NONE = {errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG, errno.ENXIO}  # no file of that name


def store_files(prefix: str, folder: Path) -> Mount:
    """Serve a folder's files, to be read only and by everybody; who verifies asks for the newest, so nothing is cached."""

    known: set[str] = set()  # opened before: the system remembers where they lie, so that opening them waits for no disk

    async def send(visit: Visit) -> WireAnswer:
        name, path = visit.rest, folder / visit.rest
        found = None
        if _NAME.fullmatch(name):
            found = _open(path) if name in known else await asyncio.to_thread(_open, path)
        if found is None:
            raise Refused("cannot find this file in the store: see /hop/list_rapps", 404)
        if len(known) > _KNOWN:
            known.clear()
        known.add(name)
        if name.endswith(".json"):
            return WireAnswer(200, "application/json", found)
        wanted = _RANGE.fullmatch(visit.request.headers.get("range", "")) if visit.request.method == "GET" else None
        if wanted is None:
            return WireAnswer(200, ANY_TYPE, found, (("Accept-Ranges", "bytes"),))
        return _rest(found, int(wanted[1]))

    return Mount(prefix, send, public=True, methods=frozenset({"GET", "HEAD"}))


def _open(path: Path) -> OpenFile | None:
    try:
        file = path.open("rb")
    except OSError as error:
        if error.errno in _NONE:
            return None
        # Never 404: for a robot that asks for the next root, that is the end of the list.
        raise Unreachable(f"cannot open this file of the store: {error.strerror}, try again later", 503) from None
    status = os.fstat(file.fileno())
    if not stat.S_ISREG(status.st_mode):
        file.close()
        return None
    return OpenFile(file, 0, status.st_size)


def _rest(whole: OpenFile, start: int) -> WireAnswer:
    """Packages never change under their names, so the rest of one fits what somebody has of it."""
    size = whole.length
    if start >= size:
        whole.file.close()
        return WireAnswer(416, ANY_TYPE, b"", (("Content-Range", f"bytes */{size}"),))
    rest = OpenFile(whole.file, start, size - start)
    return WireAnswer(206, ANY_TYPE, rest, (("Content-Range", f"bytes {start}-{size - 1}/{size}"),))
