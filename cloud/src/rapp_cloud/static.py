"""The store's files over HTTP: `/tuf/metadata/<file>` and `/tuf/targets/<file>`, nothing above or below."""

import asyncio
import re
from pathlib import Path

from rapp_hop.errors import Refused
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer
from rapp_hop.results import ANY_TYPE

_NAME = re.compile(r"[0-9A-Za-z][0-9A-Za-z._-]{0,200}", re.ASCII)  # no separator, no dot first


def store_files(prefix: str, folder: Path) -> Mount:
    """Serve a folder's files, to be read only and by everybody; who verifies asks for the newest, so nothing is cached."""

    async def send(visit: Visit) -> WireAnswer:
        path = folder / visit.rest
        if not _NAME.fullmatch(visit.rest) or not await asyncio.to_thread(path.is_file):
            raise Refused("cannot find this file in the store: see /hop/list_rapps", 404)
        kind = "application/json" if path.suffix == ".json" else ANY_TYPE
        return WireAnswer(200, kind, path)

    return Mount(prefix, send, public=True, methods=frozenset({"GET", "HEAD"}))
