"""What the platform itself sees of who did what, for the audit log: downloads by robots, and what was put on offer."""

import getpass
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rapp_cloud.audit import Audit
from rapp_cloud.memory import Memory, open_memory
from rapp_cloud.shelf import Offer, Shelf
from rapp_hop.callers import token_of
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer


def noted(mount: Mount, memory: Memory) -> Mount:
    """Note which robot downloads what; a stranger without token may download too, and is nobody to note."""

    async def handler(visit: Visit) -> WireAnswer:
        answer = await mount.handler(visit)
        name = memory.accounts.name_of(token_of(visit.request.headers))
        if name is not None and answer.status in (200, 206) and visit.request.method == "GET":
            memory.audit.note(name, "download", visit.rest)
        return answer

    return replace(mount, handler=handler)


def note_offers(audit: Audit, before: Iterable[Offer], after: Iterable[Offer]) -> None:
    """Note what is on offer that was not, and what is not any more."""
    old, new = ({offer.sha256: offer for offer in offers} for offers in (before, after))
    for deed, found in (("publish", new.keys() - old.keys()), ("yank", old.keys() - new.keys())):
        for sha256 in sorted(found):
            offer = (new | old)[sha256]
            audit.note(offer.publisher, deed, f"{offer.manifest.name} {offer.manifest.version.text}", sha256=sha256)
    audit.write()


@contextmanager
def noting_offers(data: Path, shelf: Shelf, url: str | None) -> Iterator[None]:
    """Note what the block changes of a store's offers; for commands, which have no platform's memory open. Blocking.

    :param url: see `open_memory`
    :raises HopError: when the log cannot be opened; the block is not begun then
    """
    with open_memory(data, url) as memory:
        before = shelf.offers()
        try:
            yield
        finally:
            note_offers(memory.audit, before, shelf.offers())


def operator() -> str:
    """Return who gives a command at the platform, for its audit log."""
    try:
        return f"{getpass.getuser()} at the platform"
    except (KeyError, OSError):  # an account without a name, as in a container; OSError from Python 3.13 on
        return f"account {os.getuid()} at the platform"
