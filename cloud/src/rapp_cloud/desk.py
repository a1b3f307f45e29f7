"""Where publishers who sit elsewhere hand in what they have signed at home; the platform never has their private keys.

The list is judged, the package looked at as a local one is, and both are put in their places before snapshot and
timestamp name them: whenever the power goes, robots see the old state or the new one. Blocking.
"""

import hashlib
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from tuf.api.metadata import TargetFile  # type: ignore[attr-defined]  # public, but not in __all__

from rapp_cloud.files import copy_whole
from rapp_cloud.judge import Change, judge
from rapp_cloud.ledger import Ledger, Lists
from rapp_cloud.publishing import check_publication
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.archive import inspect, package_file_name
from rapp_hop.hz.manifest import Manifest, check_numbers
from rapp_hop.hz.standing import Standing, custom_of
from rapp_hop.hz.tar import Limits

Note = Callable[[str, str], object]  # deed and subject, told before anything is on offer; may refuse


class Desk:
    """The desk of one store; each call holds the store's lock while it changes something."""

    def __init__(self, ledger: Ledger, targets: Path, limits: Limits, offered: Callable[[], Sequence[Manifest]]) -> None:
        """Remember the parts.

        :param targets: folder of the packages
        :param offered: gives the manifests of all packages on offer
        """
        self._ledger = ledger
        self._targets = targets
        self._limits = limits
        self._offered = offered

    def publish(self, publisher: str, package: Path, data: bytes, note: Note, quota: int, *, check: bool = False) -> Manifest:
        """Put a package on offer, with its publisher's signed list.

        :param quota: bytes of all packages and lists of one publisher that are here, yanked ones too
        :param check: only judge, change nothing
        :raises HopError: see `judge` and `check_publication`; also when the package is not the one of the list
        """
        judge(standing_of(self._ledger.read(), publisher), data, datetime.now(UTC))  # who has no key causes no work
        manifest, length, digest = self._seen(package)
        path = package_file_name(manifest.name, manifest.version.text)
        with self._ledger.locked():
            lists = self._ledger.read()
            standing = standing_of(lists, publisher)
            change = judge(standing, data, datetime.now(UTC))
            if change.added is None or change.withdrawn:
                raise Invalid(f"cannot publish {path}: the list must have this one package more, and all that were there")
            _check_same(change.added, manifest, length, digest)
            check_publication(manifest, self._offered())
            self._check_quota(standing, length + len(data), quota, path)
            if not check:
                note("publish", f"{manifest.name} {manifest.version}")
                copy_whole(package, self._targets / f"{digest}.{path}")
                self._put(lists, publisher, change)
        return manifest

    def replace(self, publisher: str, data: bytes, note: Note, quota: int) -> Change:
        """Take packages off offer, or have the same ones on offer for longer, by their publisher's signed list.

        :param quota: see `publish`; packages may be taken off offer beyond it
        :raises HopError: see `judge`; also when the list has a package more
        """
        with self._ledger.locked():
            lists = self._ledger.read()
            standing = standing_of(lists, publisher)
            change = judge(standing, data, datetime.now(UTC))
            if change.added is not None:
                raise Invalid(f"cannot take the list: {change.added.path} must come with it, use ./rapp publish")
            for path in change.withdrawn:
                note("yank", path.removesuffix(".hz").replace("-", " ", 1))
            if not change.withdrawn:
                self._check_quota(standing, len(data), quota)
                note("renew", f"list {change.own.version}")
            self._put(lists, publisher, change)
        return change

    def _put(self, lists: Lists, publisher: str, change: Change) -> None:
        lists.publishers[publisher] = change.own
        self._ledger.write(lists, (), {publisher: change.data})

    def _seen(self, package: Path) -> tuple[Manifest, int, str]:
        """What a package is, its length and its hash."""
        with package.open("rb") as file:
            contents = inspect(file, self._limits)
            file.seek(0)
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        check_numbers(contents.manifest)
        if not contents.for_hop:
            raise Invalid(f"cannot publish {contents.manifest.name}: it has no etc/weblet.info, build it with ./rapp hz build")
        return contents.manifest, package.stat().st_size, digest

    def _check_quota(self, standing: Standing, length: int, quota: int, path: str = "") -> None:
        """Check that `length` bytes more are not too many; what lies here of `path` is to be replaced."""
        packages = (self._targets / f"{digest}.{known}" for known, digest in standing.known.items() if known != path)
        files = [*packages, *self._ledger.folder.glob(f"*.{standing.publisher}.json")]
        used = sum(file.stat().st_size for file in files if file.exists())
        if used + length > quota:
            text = f"cannot take {path or 'the list'}: {used + length} bytes would be {standing.publisher}'s, {quota} are allowed"
            raise Refused(f"{text}; ask who keeps the platform for more", 413)


def standing_of(lists: Lists, publisher: str) -> Standing:
    """Return how a publisher stands now.

    :raises Refused: (403) when there is none of that name, or their key was revoked
    """
    if publisher not in lists.publishers:
        raise Refused(f"cannot publish as {publisher[:70]}: the store knows no key of theirs, see ./rapp keys own", 403)
    return Standing(publisher, lists.targets, lists.publishers[publisher])


def _check_same(added: TargetFile, manifest: Manifest, length: int, digest: str) -> None:
    path = package_file_name(manifest.name, manifest.version.text)
    said = added.custom or {}
    if added.path != path or {**said, "robots": ()} != {**custom_of(manifest, ()), "robots": ()}:
        raise Invalid(f"cannot publish {path}: the list is for {added.path}")
    if (added.length, added.hashes["sha256"]) != (length, digest):
        raise Invalid(f"cannot publish {path}: the list gives another length or hash, build and sign it again")
