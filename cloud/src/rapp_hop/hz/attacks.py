"""What somebody who holds the line or the mirror may try, by name; `tuf`'s exceptions turned into these, once."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import StrEnum

from tuf.api import exceptions as tuf
from tuf.api.serialization import DeserializationError

from rapp_hop.errors import HopError, Invalid, Unreachable

_MIXED = re.compile(r"Expected (snapshot version \d|\S+ v\d)")  # versions that do not fit each other, not older ones


class Attack(StrEnum):
    """What somebody who holds the line or the mirror may try; most names are TUF's (specification §1.5)."""

    UNSIGNED = "unsigned or signed by a wrong key"
    ROLLBACK = "rollback"
    FREEZE = "freeze"
    MIX_AND_MATCH = "mix-and-match"
    WRONG_CONTENT = "wrong hash or length"
    ENDLESS_DATA = "endless data"
    MALFORMED = "malformed metadata"
    SLOW = "slow retrieval"
    OTHER_ROBOT = "replay to another robot"
    CLOCK = "wrong clock"
    REVOKED = "revoked key"


class Untrusted(Invalid):
    """The store, or who pretends to be it, cannot be believed; `attack` says what it looks like, and is the `reason`."""

    def __init__(self, attack: Attack, message: str) -> None:
        super().__init__(message)
        self.attack = attack
        self.reason = attack.value


class Away(tuf.DownloadError):
    """Carries our own error through the updater."""

    def __init__(self, reason: Unreachable) -> None:
        super().__init__(str(reason))
        self.reason = reason


@contextmanager
def translated(misfit: Attack) -> Iterator[None]:
    """Turn `tuf`'s exceptions into ours, once; `misfit` names what bytes with a wrong hash or length mean here."""
    try:
        yield
    except HopError:
        raise
    except tuf.DownloadLengthMismatchError as error:
        raise untrusted(Attack.ENDLESS_DATA, error) from None
    except tuf.DownloadHTTPError as error:
        raise Unreachable(f"cannot use the store now: {error}", error.status_code) from None
    except Away as error:
        raise error.reason from None
    except tuf.DownloadError as error:
        raise Unreachable(str(error)) from None
    except (tuf.RepositoryError, DeserializationError) as error:
        raise untrusted(_attack(error, misfit), error) from None


def _attack(error: Exception, misfit: Attack) -> Attack:
    if isinstance(error, tuf.UnsignedMetadataError):
        return Attack.UNSIGNED
    if isinstance(error, tuf.ExpiredMetadataError):
        return Attack.FREEZE  # or the clock runs ahead
    if isinstance(error, tuf.BadVersionNumberError):
        return Attack.MIX_AND_MATCH if _MIXED.match(str(error)) else Attack.ROLLBACK
    return misfit if isinstance(error, tuf.LengthOrHashMismatchError) else Attack.MALFORMED


def untrusted(attack: Attack, error: object) -> Untrusted:
    """Return what to raise for an attack."""
    clock = f" (the clock says {datetime.now(UTC):%F %R})" if attack is Attack.FREEZE else ""
    return Untrusted(attack, f"cannot trust the store ({attack}): {error}{clock}, nothing was installed")
