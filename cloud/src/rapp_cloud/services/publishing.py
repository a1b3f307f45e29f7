"""Publishing from elsewhere (deliverable §1.2: providers deliver RApps): `publish_package`, `publish_list`.

The token says who hands in, that publisher's key must have signed; what is judged is in `desk` and `judge`.
"""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rapp_cloud.accounts import Accounts
from rapp_cloud.audit import Audit
from rapp_cloud.desk import Desk, Note
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.fairness import Fairness
from rapp_hop.hz.standing import MAX_LIST
from rapp_hop.hz.tar import Limits
from rapp_hop.service import Request, Service, service

ROOM = 16 * 1024  # bytes of a call around its files
MAX_CALL = Limits().packed + MAX_LIST + ROOM  # bytes
RATE, BURST = 0.5, 60.0  # calls per second of one publisher, and at once
_log = logging.getLogger(__name__)


def publishing_services(desk: Desk, accounts: Accounts, audit: Audit, quota: int) -> list[Service]:
    """Make the services.

    :param quota: bytes of all packages and lists of one publisher
    """
    tries = Fairness(RATE, BURST, time.monotonic)

    def admitted(request: Request) -> Note:
        """Let a publisher in; what they do is noted before it is done, so that nothing is on offer that is not noted."""
        if not accounts.may(request.caller, "publish"):
            raise Refused(f"cannot publish as {request.caller}: that is no publisher, ask who keeps the platform", 403)
        tries.admit(request.caller)
        return lambda deed, subject: audit.add(request.caller, deed, subject, address=request.address)

    @service(timeout=120, max_body=MAX_CALL, concurrency=2)
    def publish_package(request: Request, package: Path, signed_list: Path, check: bool = False) -> dict[str, Any]:
        """Put a package on offer with its publisher's signed list; with `check`, only tell whether it could be."""
        note = admitted(request)
        with _disk():
            manifest = desk.publish(request.caller, package, _read(signed_list), note, quota, check=check)
        return {"name": manifest.name, "version": manifest.version.text, "published": not check}

    @service(timeout=60, max_body=MAX_LIST + ROOM, concurrency=2)
    def publish_list(request: Request, signed_list: Path) -> dict[str, Any]:
        """Take packages off offer, or keep them on it for longer, by their publisher's signed list."""
        note = admitted(request)
        with _disk():
            change = desk.replace(request.caller, _read(signed_list), note, quota)
        return {"number": change.own.version, "withdrawn": list(change.withdrawn)}

    return [publish_package, publish_list]


@contextmanager
def _disk() -> Iterator[None]:
    """Say what the platform's disk is unwilling to take; what was on offer still is."""
    try:
        yield
    except OSError as error:
        _log.error("cannot write to the store: %s", error)
        raise Unreachable(f"cannot change the store now: {error.strerror}, tell who keeps the platform", 503) from None


def _read(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(MAX_LIST + 1)
