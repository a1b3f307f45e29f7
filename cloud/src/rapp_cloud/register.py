"""The register of publishers in the signed targets list: whose keys count, which names are theirs, who has no key any more.

These change lists as they are in memory; `custody` and `shelf` hold the lock and write them.
"""

from datetime import UTC, datetime

from securesystemslib.signer import Key
from tuf.api.metadata import DelegatedRole, Delegations, Targets  # type: ignore[attr-defined]

from rapp_cloud.judge import judge
from rapp_cloud.ledger import Ledger, Lists
from rapp_hop.errors import Refused
from rapp_hop.hz.application import Application
from rapp_hop.hz.standing import KNOWN, REVOKED, YANKED, Standing, pattern


def add_publisher(ledger: Ledger, lists: Lists, publisher: str) -> Targets:
    """Make a publisher's key and empty list among `lists`, not written yet. See `Custody.add`."""
    signer = ledger.prepare(lists, publisher)
    _delegate(lists, publisher, signer.public_key)
    own = Targets()
    known = lists.snapshot.meta.get(f"{publisher}.json")
    own.version = known.version if known else 0
    if known:  # its packages stay known, so that no version comes back with other bytes
        old = ledger.list_of(publisher, known.version)
        before = own.unrecognized_fields[YANKED] = Standing(publisher, lists.targets, old).known
        lists.targets.unrecognized_fields.setdefault(KNOWN, {})[publisher] = before  # for robots that were away meanwhile
    lists.publishers[publisher] = own
    return own


def admit(ledger: Ledger, lists: Lists, application: Application) -> dict[str, bytes]:
    """Put a publisher who keeps their own key among `lists`; return their list, as signed, to be written.

    :raises HopError: when the key was revoked, or the list is not an empty one with the right number
    """
    publisher, key = application.publisher, application.key
    if key.keyid in revoked_of(lists).get(publisher, {}).get("keyids", ()):
        raise Refused(f"cannot take this key: it was revoked, have {publisher} make another with ./rapp keys own --anew")
    known = lists.snapshot.meta.get(f"{publisher}.json")
    last = known.version if known else 0
    if application.own.version != last + 1:
        again = f"./rapp keys own {publisher} --after {last}"
        raise Refused(f"cannot take list {application.own.version} of {publisher}: {last + 1} comes next, have them run {again}")
    _delegate(lists, publisher, key)
    before = Standing(publisher, lists.targets, ledger.list_of(publisher, last)).known if known else {}
    lists.targets.unrecognized_fields.get(KNOWN, {}).pop(publisher, None)  # an empty list cannot have it
    empty = Targets()
    empty.version = last
    change = judge(Standing(publisher, lists.targets, empty), application.data, datetime.now(UTC))
    if change.added is not None:
        raise Refused(f"cannot take the list of {publisher}: it must be empty, have them run ./rapp keys own {publisher}")
    if before:
        lists.targets.unrecognized_fields.setdefault(KNOWN, {})[publisher] = before
    lists.publishers[publisher] = change.own
    return {publisher: application.data}


def follow(lists: Lists, application: Application) -> dict[str, bytes]:
    """Put a new key in the place of a publisher's, with the list on offer signed by it; return that list, to be written.

    :raises HopError: when the list is another
    """
    publisher, own = application.publisher, lists.publishers[application.publisher]
    for keyid in list(delegated(lists)[publisher].keyids):
        lists.targets.revoke_key(keyid, publisher)
    lists.targets.add_key(application.key, publisher)
    change = judge(Standing(publisher, lists.targets, own), application.data, datetime.now(UTC))
    if change.added is not None or change.withdrawn:
        raise Refused(f"cannot take the list of {publisher}: it must have the packages on offer, have them make it again")
    lists.publishers[publisher] = change.own
    return {publisher: application.data}


def _delegate(lists: Lists, publisher: str, key: Key) -> None:
    """Name a publisher and their key; names that were theirs are theirs again."""
    before = revoked_of(lists).pop(publisher, None)
    if lists.targets.delegations is None:
        lists.targets.delegations = Delegations({}, {})
    paths = [pattern(name) for name in before["names"]] if before else []
    delegated(lists)[publisher] = DelegatedRole(publisher, [], 1, True, paths)
    lists.targets.add_key(key, publisher)


def delegated(lists: Lists) -> dict[str, DelegatedRole]:
    """Return the publishers' delegations, to be read or changed."""
    delegations = lists.targets.delegations
    return {} if delegations is None or delegations.roles is None else delegations.roles


def owner_of(lists: Lists, name: str) -> str | None:
    """Return the publisher that a package name belongs to, None for nobody's.

    :raises Refused: when that publisher's key was revoked
    """
    for publisher, role in delegated(lists).items():
        if pattern(name) in (role.paths or ()):
            return publisher
    for publisher, entry in revoked_of(lists).items():
        if name in entry["names"]:
            raise Refused(f"cannot publish {name}: it is {publisher}'s, whose key was revoked; make a new one for them first")
    return None


def revoked_of(lists: Lists) -> dict[str, dict[str, list[str]]]:
    """Return the publishers without a key, with the key ids and names that were theirs; to be read or changed."""
    found: dict[str, dict[str, list[str]]] = lists.targets.unrecognized_fields.setdefault(REVOKED, {})
    return found
