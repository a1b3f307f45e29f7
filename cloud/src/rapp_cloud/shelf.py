"""The store's shelf: RApp packages as targets of a TUF repository, signed here, served as plain files.

Folders: `metadata/` and `targets/`, which robots see. Order of a publication: package, targets, snapshot, and the
timestamp last, so that a robot sees the old state or the new one. All writes happen under a lock, for
`rapp_cloud publish` may run beside the server. Blocking.

TUF: roles root, targets, snapshot, timestamp with a key each, threshold one, consistent snapshots. Delegation to
publishers and the life of keys come with the store's own issue.
"""

import fcntl
import hashlib
import io
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, BinaryIO

from securesystemslib.signer import Signer
from tuf.api.exceptions import RepositoryError
from tuf.api.metadata import (  # type: ignore[attr-defined]  # public, but not in __all__
    Metadata,
    MetaFile,
    Root,
    Snapshot,
    TargetFile,
    Targets,
    Timestamp,
)

from rapp_cloud.files import write_whole
from rapp_cloud.keys import ROLES, load_keys, make_keys
from rapp_hop.errors import Bug, Invalid, Refused, Unreachable
from rapp_hop.hz.archive import Contents, extract, inspect, package_file_name
from rapp_hop.hz.manifest import Manifest
from rapp_hop.hz.tar import Limits

_LOCK_PATIENCE = 10.0  # seconds


@dataclass(frozen=True)
class Expiry:
    """How long each role's word is good."""

    root: timedelta = timedelta(days=365)
    targets: timedelta = timedelta(days=90)
    snapshot: timedelta = timedelta(days=90)
    timestamp: timedelta = timedelta(days=1)


class Shelf:
    """The store's packages; make it once with `create`, then open it."""

    def __init__(self, folder: Path, keys: Path, expiry: Expiry | None = None, limits: Limits | None = None) -> None:
        """Remember the places; reads nothing yet.

        :param folder: holds metadata/ and targets/
        :param keys: private folder of the keys
        """
        self.metadata = folder / "metadata"
        self.targets = folder / "targets"
        self._keys = keys
        self._expiry = expiry or Expiry()
        self._limits = limits or Limits()
        self._manifests: dict[str, Manifest] = {}  # by target path: a target never changes

    @property
    def root_file(self) -> Path:
        """The root metadata to give to robots, once, on a way that is trusted."""
        return self.metadata / "1.root.json"

    def create(self) -> None:
        """Make keys and an empty, signed repository.

        :raises Refused: when there is one already
        """
        if self.root_file.exists():
            raise Refused(f"cannot make a store in {self.metadata.parent}: there is one")
        for folder in (self.metadata, self.targets):
            folder.mkdir(parents=True, exist_ok=True)
        signers = make_keys(self._keys)
        root = Root(consistent_snapshot=True, expires=_from_now(self._expiry.root))
        for role in ROLES:
            root.add_key(signers[role].public_key, role)
        self._sign(root, "root", signers, f"{root.version}.root.json")
        with self._locked():
            self._publish(Targets(), Snapshot(), Timestamp(), signers)

    def publish(self, package: bytes) -> Manifest:
        """Check a package, sign for it and offer it.

        The same bytes again change nothing.

        :raises Invalid: when it is not a right package
        :raises Refused: when this version was published with other bytes (S20)
        """
        manifest = inspect(io.BytesIO(package), self._limits).manifest
        path = package_file_name(manifest.name, manifest.version.text)
        with self._locked():
            timestamp, snapshot, targets = self._state()
            there = targets.targets.get(path)
            digest = hashlib.sha256(package).hexdigest()
            if there is not None:
                if there.hashes["sha256"] != digest:
                    raise Refused(f"cannot publish {path}: published with other bytes before, raise its version")
                return manifest
            target = TargetFile.from_data(path, package, ["sha256"])
            target.unrecognized_fields["custom"] = {"name": manifest.name, "version": manifest.version.text}
            targets.targets[path] = target
            write_whole(self.targets / f"{digest}.{path}", package)
            targets.version += 1
            snapshot.version += 1
            timestamp.version += 1
            self._publish(targets, snapshot, timestamp, load_keys(self._keys))
        return manifest

    def refresh(self) -> None:
        """Sign a new timestamp, and snapshot and targets too when half of their time is over."""
        with self._locked():
            timestamp, snapshot, targets = self._state()
            half = datetime.now(UTC) + min(self._expiry.targets, self._expiry.snapshot) / 2
            if targets.expires < half or snapshot.expires < half:
                targets.version += 1
                snapshot.version += 1
            timestamp.version += 1
            self._publish(targets, snapshot, timestamp, load_keys(self._keys))

    def manifests(self) -> list[Manifest]:
        """Return the manifests of all packages on offer; each package is read once.

        :raises Bug: when a package is gone or was changed behind our back
        """
        targets = self._state()[2].targets
        for path, target in targets.items():
            if path not in self._manifests:
                self._manifests[path] = self._manifest(target)
        return [self._manifests[path] for path in sorted(targets)]

    def unpack(self, name: str, version: str, folder: Path) -> None:
        """Unpack a package on offer into a new folder.

        :raises Refused: there is none of that name and version
        :raises Bug: as for `manifests`
        """
        target = self._state()[2].targets.get(package_file_name(name, version))
        if target is None:
            raise Refused(f"cannot find {name} {version}: it is not in the store")
        self._read(target, lambda file: extract(file, folder, self._limits))

    def _manifest(self, target: TargetFile) -> Manifest:
        return self._read(target, lambda file: inspect(file, self._limits)).manifest

    def _read(self, target: TargetFile, read: Callable[[BinaryIO], Contents]) -> Contents:
        try:
            with (self.targets / f"{target.hashes['sha256']}.{target.path}").open("rb") as file:
                target.verify_length_and_hashes(file)
                file.seek(0)
                return read(file)
        except (OSError, RepositoryError, Invalid) as error:
            raise Bug(f"cannot read {target.path} on the shelf: {error}, restore it from a backup") from None

    def _state(self) -> tuple[Timestamp, Snapshot, Targets]:
        """Return what is on offer now, as copies that may be changed."""
        try:
            timestamp = Metadata[Timestamp].from_bytes((self.metadata / "timestamp.json").read_bytes()).signed
            version = timestamp.snapshot_meta.version
            snapshot = Metadata[Snapshot].from_bytes((self.metadata / f"{version}.snapshot.json").read_bytes()).signed
            version = snapshot.meta["targets.json"].version
            targets = Metadata[Targets].from_bytes((self.metadata / f"{version}.targets.json").read_bytes()).signed
        except (OSError, RepositoryError, KeyError) as error:
            raise Refused(f"cannot read the store in {self.metadata.parent}: {error}, run rapp_cloud init") from None
        return timestamp, snapshot, targets

    def _publish(self, targets: Targets, snapshot: Snapshot, timestamp: Timestamp, signers: Mapping[str, Signer]) -> None:
        targets.expires = _from_now(self._expiry.targets)
        snapshot.expires = _from_now(self._expiry.snapshot)
        timestamp.expires = _from_now(self._expiry.timestamp)
        name = f"{targets.version}.targets.json"
        if snapshot.meta["targets.json"].version != targets.version or not (self.metadata / name).exists():
            data = self._sign(targets, "targets", signers, name)
            snapshot.meta["targets.json"] = MetaFile.from_data(targets.version, data, ["sha256"])
        name = f"{snapshot.version}.snapshot.json"
        if timestamp.snapshot_meta.version != snapshot.version or not (self.metadata / name).exists():
            data = self._sign(snapshot, "snapshot", signers, name)
            timestamp.snapshot_meta = MetaFile.from_data(snapshot.version, data, ["sha256"])
        self._sign(timestamp, "timestamp", signers, "timestamp.json")

    def _sign(
        self, signed: Root | Timestamp | Snapshot | Targets, role: str, signers: Mapping[str, Signer], file_name: str
    ) -> bytes:
        metadata: Metadata[Any] = Metadata(signed)
        metadata.sign(signers[role])
        data = metadata.to_bytes()
        write_whole(self.metadata / file_name, data)
        return data

    @contextmanager
    def _locked(self) -> Iterator[None]:
        end = time.monotonic() + _LOCK_PATIENCE
        with (self.metadata.parent / ".lock").open("w") as lock:
            while True:
                try:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                except BlockingIOError:
                    if time.monotonic() > end:
                        raise Unreachable("cannot change the store now: somebody else does, try again") from None
                    time.sleep(0.02)
            yield


def _from_now(span: timedelta) -> datetime:
    return (datetime.now(UTC) + span).replace(microsecond=0)
