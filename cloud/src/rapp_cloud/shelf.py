"""The store's shelf: RApp packages as targets of a TUF repository, signed here, served as plain files.

Folders: `metadata/` and `targets/`, which robots see. All writes happen under a lock, for `rapp_cloud publish` may run
beside the server. Blocking. Who signs what: `ledger`, `custody`, `register`, `keys`.
"""

import hashlib
import io
import logging
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from tuf.api.metadata import TargetFile, Targets  # type: ignore[attr-defined]  # public, but not in __all__

from rapp_cloud.custody import Custody
from rapp_cloud.desk import Desk
from rapp_cloud.files import write_whole
from rapp_cloud.keys import ROLES, KeyRing, Passphrase
from rapp_cloud.ledger import Expiry, Ledger, Lists
from rapp_cloud.packages import PackageFiles
from rapp_cloud.publishing import check_publication
from rapp_cloud.register import add_publisher, delegated, owner_of
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.archive import extract, inspect, package_file_name
from rapp_hop.hz.manifest import Manifest, check_numbers
from rapp_hop.hz.standing import YANKED, custom_of, pattern
from rapp_hop.hz.tar import Limits

__all__ = ["Expiry", "Offer", "Shelf"]

PUBLISHER = "rapp"  # who publishes where nobody else is named
_NEVER = datetime.max.replace(tzinfo=UTC)
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Offer:
    """A package on the shelf."""

    manifest: Manifest
    publisher: str
    length: int  # bytes
    sha256: str
    robots: tuple[str, ...]  # names of those it is for; none: all
    yanked: bool = False
    expired: bool = False  # its publisher's list has run out: robots refuse it until they sign the next one


@dataclass(frozen=True)
class _Seen:
    """What was on offer."""

    state: tuple[int, int]  # of the timestamp's file
    until: datetime  # the first of the lists that are good runs out
    offers: list[Offer]
    manifests: tuple[Manifest, ...]
    believed: tuple[Manifest, ...]
    files: dict[str, str]  # on offer to everybody: by the package's file name, that of the file here


class Shelf:
    """The store's packages; make it once with `create`, then open it."""

    def __init__(
        self,
        folder: Path,
        keys: Path,
        expiry: Expiry | None = None,
        limits: Limits | None = None,
        passphrase: Passphrase | None = None,
    ) -> None:
        """Remember the places; reads nothing yet.

        :param folder: holds metadata/ and targets/; beside it is cache/
        :param keys: private folder of the keys
        """
        self.metadata = folder / "metadata"
        self.targets = folder / "targets"
        self._keys = KeyRing(keys, passphrase)
        self._ledger = Ledger(self.metadata, self._keys, expiry)
        self._limits = limits or Limits()
        self._packages = PackageFiles(self.targets, folder.parent / "cache" / "packages.jsonl", self._limits)
        self._seen: _Seen | None = None
        self.custody = Custody(self._ledger)
        self.desk = Desk(self._ledger, self.targets, self._limits, self.manifests)

    @property
    def root_file(self) -> Path:
        """The root metadata to give to robots, once, on a way that is trusted."""
        return self.metadata / "1.root.json"

    def create(self) -> None:
        """Make keys and an empty, signed repository with one publisher.

        :raises Refused: when there is one already
        """
        if self.root_file.exists():
            raise Refused(f"cannot make a store in {self.metadata.parent}: there is one")
        if self._keys.names():
            raise Refused(f"cannot make keys in {self._keys.folder}: there are some, keep them")
        for folder in (self.metadata, self.targets):
            folder.mkdir(parents=True, exist_ok=True)
        signers = {role: self._keys.new(role) for role in ROLES}
        for role, signer in signers.items():
            self._keys.keep(role, signer)
        with self._ledger.locked():
            lists = self._ledger.create(signers)
            add_publisher(self._ledger, lists, PUBLISHER)
            self._ledger.write(lists, ["targets", PUBLISHER])

    def adopt(self) -> None:
        """Bring a store of an earlier version to this one: keys locked, packages with a publisher of their own."""
        with self._ledger.locked():
            for name in self._keys.encrypt_all():
                _log.info("the key of %s is encrypted now", name)
            lists = self._ledger.read()
            if delegated(lists) or self.custody.holders()[len(ROLES) :]:
                return
            own = add_publisher(self._ledger, lists, PUBLISHER)
            own.targets, lists.targets.targets = lists.targets.targets, {}
            names = sorted({str(target.custom["name"]) for target in own.targets.values()})
            delegated(lists)[PUBLISHER].paths = [pattern(name) for name in names]
            self._ledger.write(lists, ["targets", PUBLISHER])

    def publish(self, package: bytes, publisher: str | None = None, robots: tuple[str, ...] = ()) -> Manifest:
        """Check a package, sign for it as its publisher and offer it. The same bytes again change nothing.

        :param publisher: None: whose name it is, or `PUBLISHER`
        :param robots: names of the only robots it is for; none: all
        :raises Invalid: when it is not a right package
        :raises Refused: when this version was published with other bytes (S20), the name is another's, or it may not
            stand beside the packages on offer (`check_publication`)
        """
        contents = inspect(io.BytesIO(package), self._limits)
        manifest = contents.manifest
        check_numbers(manifest)
        if not contents.for_hop:
            raise Invalid(f"cannot publish {manifest.name}: it has no etc/weblet.info, build it with ./rapp hz build")
        path = package_file_name(manifest.name, manifest.version.text)
        digest = hashlib.sha256(package).hexdigest()
        with self._ledger.locked():
            lists = self._ledger.read()
            publisher, own, changed = _desk(lists, manifest.name, publisher)
            if _known(own, path) not in (None, digest):
                raise Refused(f"cannot publish {path}: published with other bytes before, raise its version")
            if path in own.targets:
                return manifest
            check_publication(manifest, [offer.manifest for offer in self._offers(lists)])
            target = TargetFile.from_data(path, package, ["sha256"])
            target.unrecognized_fields["custom"] = custom_of(manifest, robots)
            own.targets[path] = target
            own.unrecognized_fields.get(YANKED, {}).pop(path, None)
            write_whole(self.targets / f"{digest}.{path}", package)
            self._ledger.write(lists, [publisher, *changed])
        return manifest

    def yank(self, name: str, version: str) -> None:
        """Take a version off offer; robots that have it keep it, and may go back behind it.

        :raises Refused: when it is not on offer
        """
        path = package_file_name(name, version)
        with self._ledger.locked():
            lists = self._ledger.read()
            publisher = owner_of(lists, name)
            own = lists.publishers[publisher] if publisher else Targets()
            if publisher is None or path not in own.targets:
                raise Refused(f"cannot yank {name} {version}: it is not on offer, see ./rapp store list")
            gone = own.targets.pop(path)
            own.unrecognized_fields.setdefault(YANKED, {})[path] = gone.hashes["sha256"]
            self._ledger.write(lists, [publisher])

    def refresh(self) -> None:
        """Sign a new timestamp, and other lists and root when half of their time is over and their key is here."""
        with self._ledger.locked():
            lists = self._ledger.read()
            if lists.root.expires < datetime.now(UTC) + self._ledger.expiry.root / 2:
                self._renew_root(lists)
            due = []
            for name in self._ledger.overdue(lists):
                try:
                    self._ledger.signer(lists, name)
                    due.append(name)
                except Refused as error:
                    _log.warning("%s: its list runs out", error)
            self._ledger.write(lists, due)

    def manifests(self) -> tuple[Manifest, ...]:
        """Return the manifests of all packages on offer; each package is read once. The same tuple until something changes.

        :raises Bug: when a package is gone or was changed behind our back
        """
        return self._look().manifests

    def believed(self) -> tuple[Manifest, ...]:
        """Do as `manifests`, without the packages whose publisher's list has run out, which robots refuse."""
        return self._look().believed

    def offers(self, *, yanked: bool = False) -> list[Offer]:
        """Return all packages on offer, and those taken off it when wanted; see `manifests`."""
        if not yanked:
            return list(self._look().offers)
        lists = self._ledger.read()
        return _sorted([*self._offers(lists), *self._yanked(lists)])

    def _look(self) -> "_Seen":
        state, seen, now = self._state(), self._seen, datetime.now(UTC)
        if seen is None or seen.state != state or seen.until <= now:
            lists = self._ledger.read()
            offers = _sorted(self._offers(lists))
            self._packages.keep()
            until = min((own.expires for own in lists.publishers.values() if own.expires > now), default=_NEVER)
            believed = tuple(offer.manifest for offer in offers if not offer.expired)
            seen = self._seen = _Seen(state, until, offers, tuple(offer.manifest for offer in offers), believed, _files(offers))
        return seen

    def _state(self) -> tuple[int, int]:
        """What changes with every change of the store, by whichever process."""
        try:
            status = (self.metadata / "timestamp.json").stat()
        except OSError:
            return (0, 0)
        return (status.st_mtime_ns, status.st_ino)

    def unpack(self, name: str, version: str, folder: Path) -> None:
        """Unpack a package on offer into a new folder.

        :raises Refused: there is none of that name and version
        :raises Bug: as for `manifests`
        """
        path = package_file_name(name, version)
        for targets in self._ledger.read().publishers.values():
            if path in targets.targets:
                self._packages.read(targets.targets[path], lambda file: extract(file, folder, self._limits))
                return
        raise Refused(f"cannot find {name} {version}: it is not in the store")

    def file_of(self, path: str) -> Path | None:
        """Return where a package on offer to everybody lies, by its file name; None: there is none."""
        name = self._look().files.get(path)
        return self.targets / name if name else None

    def _offers(self, lists: Lists) -> Iterator[Offer]:
        for publisher, targets in [(PUBLISHER, lists.targets), *lists.publishers.items()]:
            late = targets.expires <= datetime.now(UTC)
            for target in targets.targets.values():
                robots, digest = tuple((target.custom or {}).get("robots", ())), target.hashes["sha256"]
                yield Offer(self._packages.manifest(target), publisher, target.length, digest, robots, expired=late)

    def _yanked(self, lists: Lists) -> Iterator[Offer]:
        for publisher, targets in lists.publishers.items():
            for path, digest in targets.unrecognized_fields.get(YANKED, {}).items():
                length = (self.targets / f"{digest}.{path}").stat().st_size
                target = TargetFile(length, {"sha256": digest}, path)
                yield Offer(self._packages.manifest(target), publisher, length, digest, (), yanked=True)

    def _renew_root(self, lists: Lists) -> None:
        try:
            signers = self._ledger.root_signers(lists)
        except Refused as error:
            _log.warning("%s: it runs out at %s", error, lists.root.expires)
            return
        lists.root.version += 1
        self._ledger.write_root(lists.root, signers)


def _desk(lists: Lists, name: str, publisher: str | None) -> tuple[str, Targets, list[str]]:
    """Return who publishes a package, their list, and "targets" when the name is theirs only from now on."""
    owner = owner_of(lists, name)
    publisher = publisher or owner or PUBLISHER
    if owner is not None and owner != publisher:
        raise Refused(f"cannot publish {name} as {publisher}: the name is {owner}'s, choose another")
    if publisher not in lists.publishers:
        raise Refused(f"cannot publish as {publisher}: there is no such publisher, make one with ./rapp keys new {publisher}")
    if owner is None:
        role = delegated(lists)[publisher]
        role.paths = [*(role.paths or ()), pattern(name)]
    return publisher, lists.publishers[publisher], [] if owner else ["targets"]


def _sorted(offers: Iterable[Offer]) -> list[Offer]:
    return sorted(offers, key=lambda offer: (offer.manifest.name, offer.manifest.version.key))


def _files(offers: Iterable[Offer]) -> dict[str, str]:
    paths = ((package_file_name(each.manifest.name, each.manifest.version.text), each) for each in offers)
    return {path: f"{each.sha256}.{path}" for path, each in paths if not each.robots}


def _known(own: Targets, path: str) -> str | None:
    if path in own.targets:
        return own.targets[path].hashes["sha256"]
    found: str | None = own.unrecognized_fields.get(YANKED, {}).get(path)
    return found
