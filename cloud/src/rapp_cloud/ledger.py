"""The store's signed lists on disk: root, timestamp, snapshot, targets and one list per publisher, as TUF has them.

Targets names the publishers, their keys and the packages that are theirs (delegation by `<name>-*.hz`, terminating);
each publisher's list names their packages. Order of a change: lists from below, snapshot, and the timestamp last, so
that a robot sees the old state or the new one. Blocking.
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from securesystemslib.signer import CryptoSigner
from tuf.api.exceptions import RepositoryError, UnsignedMetadataError
from tuf.api.metadata import Metadata, MetaFile, Root, Snapshot, Targets, Timestamp  # type: ignore[attr-defined]
from tuf.api.serialization import DeserializationError

from rapp_cloud.files import write_whole
from rapp_cloud.keys import ROLES, ROOTS, KeyRing
from rapp_hop.errors import Refused
from rapp_hop.hz.lock import held
from rapp_hop.hz.trust import SIGNED_AT

_KEPT = timedelta(days=1)  # that a list stays after another has followed it: robots may be about to read it
_NEXT = "next_"  # begin of the name of a key that a rotation has made and not yet put in its place


@dataclass(frozen=True)
class Expiry:
    """How long each role's word is good; a publisher's as long as that of targets."""

    root: timedelta = timedelta(days=365)
    targets: timedelta = timedelta(days=90)
    snapshot: timedelta = timedelta(days=90)
    timestamp: timedelta = timedelta(days=1)


@dataclass
class Lists:
    """All lists, as copies that may be changed."""

    root: Root
    timestamp: Timestamp
    snapshot: Snapshot
    targets: Targets
    publishers: dict[str, Targets] = field(default_factory=dict)


class Ledger:
    """The lists of one store."""

    def __init__(self, folder: Path, keys: KeyRing, expiry: Expiry | None = None) -> None:
        """Remember the places; reads nothing yet."""
        self.folder = folder
        self.keys = keys
        self.expiry = expiry or Expiry()

    def create(self, signers: dict[str, CryptoSigner]) -> Lists:
        """Write the first root, and return lists that are empty and not written yet."""
        root = Root(consistent_snapshot=True)
        for role in ROLES:
            root.add_key(signers[role].public_key, role)
        lists = Lists(root, Timestamp(), Snapshot(), Targets())
        for signed in (lists.timestamp, lists.snapshot, lists.targets):
            signed.version = 0  # the first one written is number 1
        self.write_root(root, [signers["root"]])
        return lists

    def read(self) -> Lists:
        """Return what is on offer now.

        :raises Refused: when there is no store, or it cannot be read
        """
        try:
            root = self._read(f"{self._root_number()}.root.json", Root)
            timestamp = self._read("timestamp.json", Timestamp)
            snapshot = self._read(f"{timestamp.snapshot_meta.version}.snapshot.json", Snapshot)
            targets = self._read(f"{snapshot.meta['targets.json'].version}.targets.json", Targets)
            names = (targets.delegations.roles or {}) if targets.delegations else {}
            publishers = {name: self._read(f"{snapshot.meta[f'{name}.json'].version}.{name}.json", Targets) for name in names}
        except (OSError, RepositoryError, DeserializationError, KeyError) as error:
            raise Refused(f"cannot read the store in {self.folder.parent}: {error}, run rapp_cloud init") from None
        return Lists(root, timestamp, snapshot, targets, publishers)

    def list_of(self, name: str, version: int) -> Targets:
        """Return an earlier or revoked list of a publisher."""
        found: Targets = self._read(f"{version}.{name}.json", Targets)
        return found

    def write(self, lists: Lists, changed: Iterable[str], given: Mapping[str, bytes] | None = None) -> None:
        """Sign and write the changed lists anew (targets, publishers), then snapshot and timestamp.

        "snapshot" among the changed has that signed anew; nothing changed: the timestamp alone, and old lists go.

        :param given: publishers' lists that were signed elsewhere; `lists` has them too
        """
        given = given or {}
        names = {*changed, *given}
        for name in sorted(names - {"snapshot"}, key=lambda name: (name == "targets", name)):
            signed = lists.targets if name == "targets" else lists.publishers[name]
            if name in given:
                data = given[name]
                write_whole(self.folder / f"{signed.version}.{name}.json", data)
            else:
                data = self._sign(lists, name, signed, self.expiry.targets)
            lists.snapshot.meta[f"{name}.json"] = MetaFile.from_data(signed.version, data, ["sha256"])
        if names:
            data = self._sign(lists, "snapshot", lists.snapshot, self.expiry.snapshot)
            lists.timestamp.snapshot_meta = MetaFile.from_data(lists.snapshot.version, data, ["sha256"])
        now = datetime.now(UTC).replace(microsecond=0)
        lists.timestamp.unrecognized_fields[SIGNED_AT] = now.isoformat()
        self._sign(lists, "timestamp", lists.timestamp, self.expiry.timestamp)
        for name in (*ROLES, *ROOTS[1:], *lists.publishers):
            self._settle_believed(lists, name)
        if not names:
            self._forget(lists)

    def write_root(self, root: Root, signers: Iterable[CryptoSigner]) -> None:
        """Sign a root with all of these and write it."""
        root.expires = _from_now(self.expiry.root)
        metadata: Metadata[Any] = Metadata(root)
        for signer in signers:
            metadata.sign(signer, append=True)
        write_whole(self.folder / f"{root.version}.root.json", metadata.to_bytes())

    def overdue(self, lists: Lists) -> list[str]:
        """Return the lists whose time is half over, or that a change of keys cut short left with an old signature."""
        half = datetime.now(UTC) + min(self.expiry.targets, self.expiry.snapshot) / 2
        found = [name for name, signed in self._named(lists) if signed.expires < half]
        return [
            *found,
            *(name for name, signed in self._named(lists) if name not in found and not self._holds(lists, name, signed)),
        ]

    def signer(self, lists: Lists, name: str) -> CryptoSigner:
        """Return the key that robots will believe for a role or publisher, be it a prepared one.

        :raises Refused: when it is not here
        """
        wanted = _keyids(lists, name)
        for kept in (name, _NEXT + name):
            if self.keys.has(kept) and (signer := self.keys.signer(kept)).public_key.keyid in wanted:
                return signer
        if not self.keys.has(name):
            next_step = "who has it signs with --cloud" if name in lists.publishers else "bring it there"
            raise Refused(f"cannot sign as {name}: {name}.pem is not in {self.keys.folder}, {next_step}")
        raise Refused(f"cannot sign as {name}: its key in {self.keys.folder} is not the one that robots believe")

    def root_signers(self, lists: Lists) -> list[CryptoSigner]:
        """Return the root's keys that are here, be they prepared ones.

        :raises Refused: when they are fewer than must sign
        """
        role = lists.root.roles["root"]
        found = [self.keys.signer(name) for root in ROOTS for name in (root, _NEXT + root) if self.keys.has(name)]
        here = {signer.public_key.keyid: signer for signer in found if signer.public_key.keyid in role.keyids}
        if len(here) < role.threshold:
            which = f"{len(here)} of the {len(role.keyids)} keys that robots believe in {self.keys.folder}"
            raise Refused(f"cannot sign as root: there are {which}, {role.threshold} must sign; bring another there")
        return list(here.values())

    def prepare(self, lists: Lists, name: str) -> CryptoSigner:
        """Make the key that is to follow and keep it beside the present one, so that none is lost whenever the power is."""
        self._settle_believed(lists, name)
        signer = self.keys.new(name)
        self.keys.keep(_NEXT + name, signer)
        return signer

    def settle(self, name: str) -> None:
        """Put the prepared key in its place: what is on the disk names it by now."""
        self.keys.keep(name, self.keys.signer(_NEXT + name))
        self.keys.remove(_NEXT + name)

    def drop(self, name: str) -> None:
        """Throw away a key, and one that was to follow it."""
        self.keys.remove(name)
        self.keys.remove(_NEXT + name)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the store alone; other processes may publish too."""
        with held(self.folder.parent / ".lock", "change the store"):
            yield

    def _forget(self, lists: Lists) -> None:
        """Remove lists that others have followed long ago; roots stay, robots go from each to the next."""
        newest = {"snapshot": lists.snapshot.version}
        newest |= {path.removesuffix(".json"): meta.version for path, meta in lists.snapshot.meta.items()}
        last = (datetime.now(UTC) - _KEPT).timestamp()
        for name, version in newest.items():
            found = sorted((int(path.name.split(".")[0]), path) for path in self.folder.glob(f"[0-9]*.{name}.json"))
            written = [path.stat().st_mtime for _, path in found]
            for (number, path), followed in zip(found, written[1:], strict=False):  # a resumed store leaves numbers out
                if number < version and followed < last:
                    path.unlink()

    def _settle_believed(self, lists: Lists, name: str) -> None:
        if self.keys.has(_NEXT + name) and self.keys.signer(_NEXT + name).public_key.keyid in _keyids(lists, name):
            self.settle(name)

    def _named(self, lists: Lists) -> list[tuple[str, Any]]:
        return [("snapshot", lists.snapshot), ("targets", lists.targets), *lists.publishers.items()]

    def _holds(self, lists: Lists, name: str, signed: Any) -> bool:
        delegator: Any = lists.targets if name in lists.publishers else lists.root
        metadata = Metadata[Any].from_file(str(self.folder / f"{signed.version}.{name}.json"))
        try:
            delegator.verify_delegate(name, metadata.signed_bytes, metadata.signatures)
        except UnsignedMetadataError:
            return False
        return True

    def _sign(self, lists: Lists, name: str, signed: Any, lasts: timedelta) -> bytes:
        signed.version += 1
        signed.expires = _from_now(lasts)
        metadata: Metadata[Any] = Metadata(signed)
        metadata.sign(self.signer(lists, name))
        data = metadata.to_bytes()
        write_whole(self.folder / ("timestamp.json" if name == "timestamp" else f"{signed.version}.{name}.json"), data)
        return data

    def _root_number(self) -> int:
        return max((int(path.name.split(".")[0]) for path in self.folder.glob("*.root.json")), default=1)

    def _read(self, name: str, kind: type[Any]) -> Any:
        signed = Metadata[Any].from_bytes((self.folder / name).read_bytes()).signed
        if not isinstance(signed, kind):
            raise RepositoryError(f"{name} is a list of another kind")
        return signed


def _keyids(lists: Lists, name: str) -> list[str]:
    if name in ROOTS and name not in lists.publishers:
        return list(lists.root.roles["root"].keyids)
    if name in ROLES:
        return list(lists.root.roles[name].keyids)
    delegations = lists.targets.delegations
    role = (delegations.roles or {}).get(name) if delegations else None
    return list(role.keyids) if role else []


def _from_now(span: timedelta) -> datetime:
    return (datetime.now(UTC) + span).replace(microsecond=0)
