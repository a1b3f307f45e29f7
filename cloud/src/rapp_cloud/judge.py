"""What a publisher's new list may change: one package more, packages taken off offer, a later end, and nothing else. Pure.

The list was made and signed elsewhere; robots will believe it, so the platform lets nothing in that it would not have
written itself. Order of the questions: whose signature, which number, what for.
"""

import copy
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from tuf.api.exceptions import RepositoryError, UnsignedMetadataError
from tuf.api.metadata import Metadata, TargetFile, Targets  # type: ignore[attr-defined]  # public, but not in __all__
from tuf.api.serialization import DeserializationError

from rapp_hop import strict_json
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.archive import package_file_name
from rapp_hop.hz.semver import parse_version
from rapp_hop.hz.standing import MAX_LIST, YANKED, Standing, check_own
from rapp_hop.hz.text import check_name

STALE = 409  # HTTP status: the list was made of another one than is on offer
SHORTEST, LONGEST = timedelta(days=1), timedelta(days=400)  # that a list may be good
MAX_ROBOTS = 1000  # that a package may be for


@dataclass(frozen=True)
class Change:
    """A list that may follow, and what it changes."""

    data: bytes  # as it was signed
    own: Targets
    added: TargetFile | None
    withdrawn: tuple[str, ...]  # paths


def judge(standing: Standing, data: bytes, now: datetime) -> Change:
    """Judge a publisher's signed list by the one that is on offer.

    :raises Invalid: when it is broken, or says what no list may say
    :raises Refused: when the key is not this publisher's (403), somebody published meanwhile (`STALE`), a name is
        another's, or something older is gone or changed
    """
    own = _parsed(standing, data)
    _check_number(standing, own)
    if not now + SHORTEST <= own.expires <= now + LONGEST:
        allowed = f"{SHORTEST.days} to {LONGEST.days} days"
        raise Invalid(f"cannot take the list: it is good until {own.expires:%F}, sign one for {allowed}; is the clock right?")
    if own.delegations is not None or set(own.unrecognized_fields) - {YANKED}:
        raise Invalid("cannot take the list: it says more than packages, sign it with ./rapp publish")
    _check_older(standing, own)
    added = [target for path, target in own.targets.items() if path not in standing.own.targets]
    if len(added) > 1:
        raise Invalid(f"cannot take the list: it has {len(added)} packages more, hand them in one by one")
    for target in added:
        _check_new(standing, target)
    withdrawn = tuple(sorted(set(standing.own.targets) - set(own.targets)))
    return Change(data, own, added[0] if added else None, withdrawn)


def _parsed(standing: Standing, data: bytes) -> Targets:
    strict_json.loads(data, limit=MAX_LIST)  # one reading only: robots may use another reader
    try:
        metadata = Metadata[Any].from_bytes(data)
        if not isinstance(metadata.signed, Targets) or isinstance(metadata.signed.version, bool):
            raise Invalid("cannot take the list: it is of another kind, sign it with ./rapp publish")
        standing.targets.verify_delegate(standing.publisher, metadata.signed_bytes, metadata.signatures)
    except UnsignedMetadataError:
        raise Refused(
            f"cannot take the list: it is not signed by {standing.publisher}'s key, see ./rapp keys list on the platform", 403
        ) from None
    except (DeserializationError, RepositoryError, ValueError):
        raise Invalid("cannot take the list: it is no list of packages, sign it with ./rapp publish") from None
    _check_spelling(standing, data, metadata)
    return metadata.signed


def _check_spelling(standing: Standing, data: bytes, metadata: Metadata[Any]) -> None:
    """Nothing around what was signed: no words, signatures or spaces that could be of any length."""
    signatures = metadata.signatures
    more = metadata.unrecognized_fields or any(signature.unrecognized_fields for signature in signatures.values())
    if more or set(signatures) - set(standing.role.keyids) or data != metadata.to_bytes():
        raise Invalid("cannot take the list: there is more in it than was signed, sign it with ./rapp publish")


def _check_number(standing: Standing, own: Targets) -> None:
    wanted = standing.own.version + 1
    if own.version < wanted:
        text = f"cannot take list {own.version} of {standing.publisher}: {wanted - 1} is on offer"
        raise Refused(f"{text}, somebody published meanwhile; run it again", STALE)
    if own.version > wanted:
        raise Refused(f"cannot take list {own.version} of {standing.publisher}: {wanted} comes next; run it again", STALE)


def _check_older(standing: Standing, own: Targets) -> None:
    """What was ever on offer stays as it was: on offer, or yanked with its hash."""
    yanked = own.unrecognized_fields.get(YANKED, {})
    if not isinstance(yanked, dict) or set(yanked) & set(own.targets):
        raise Invalid("cannot take the list: what it has yanked cannot be read, sign it with ./rapp publish")
    for path, target in standing.own.targets.items():
        if own.targets.get(path, target) != target:
            raise Refused(f"cannot take the list: it changes {path}, raise its version instead")
    known = standing.known
    for path, digest in known.items():
        found = own.targets[path].hashes.get("sha256") if path in own.targets else yanked.get(path)
        if found is None:
            raise Refused(f"cannot take the list: {path} is gone from it, yank it instead")
        if found != digest:
            raise Refused(f"cannot take the list: {path} was published with other bytes before, raise its version")
    if strange := sorted(set(yanked) - set(known)):
        raise Invalid(f"cannot take the list: it yanks {strange[0][:200]!r}, which was never on offer")


def _check_new(standing: Standing, target: TargetFile) -> None:
    if not isinstance(target.custom, dict):
        raise Invalid(f"cannot take {target.path[:200]!r}: the list does not say what it is, sign it with ./rapp publish")
    custom = copy.copy(target.custom)
    name, version = check_name(str(custom.pop("name", ""))), parse_version(str(custom.pop("version", "")))
    robots = custom.pop("robots", [])
    if target.path != package_file_name(name, version.text) or custom or set(target.unrecognized_fields) - {"custom"}:
        raise Invalid(f"cannot take {target.path[:200]!r}: the list says another thing of it, sign it with ./rapp publish")
    if not isinstance(robots, list) or len(robots) > MAX_ROBOTS:
        raise Invalid(f"cannot take {target.path}: the robots it is for must be a list of {MAX_ROBOTS} at most")
    for robot in robots:
        check_name(str(robot))
    if set(target.hashes) != {"sha256"}:
        raise Invalid(f"cannot take {target.path}: the list must give its sha256, and no other hash")
    check_own(standing, name)
