"""A TUF repository in memory with a life of its own: publish, expire, swap keys, and play the attacker's tricks."""

from datetime import UTC, datetime, timedelta
from typing import Any

from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import Metadata, MetaFile, Root, Snapshot, TargetFile, Targets, Timestamp

from rapp_hop.errors import Invalid, Refused, Unreachable
from rapp_hop.streaming import Progress, Writer

ROLES = ("root", "targets", "snapshot", "timestamp")
URL = "http://store.example/tuf"


class Repository:
    """Implements the port `rapp_hop.hz.trust.Transport`; `files` is what the line delivers, free to be tampered with."""

    def __init__(self) -> None:
        self.signers = {role: CryptoSigner.generate_ed25519() for role in ROLES}
        later = datetime.now(UTC).replace(microsecond=0) + timedelta(days=30)
        self.root, self.targets = Root(expires=later), Targets(expires=later)
        self.snapshot, self.timestamp = Snapshot(expires=later), Timestamp(expires=later)
        for role in ROLES:
            self.root.add_key(self.signers[role].public_key, role)
        self.files: dict[str, bytes] = {}
        self.asked: list[tuple[str, int]] = []
        self.away = False
        self._write("1.root.json", self.root, "root")
        self.sign()

    @property
    def trusted_root(self) -> bytes:
        return self.files["metadata/1.root.json"]

    def publish(self, name: str, version: str, data: bytes) -> None:
        path = f"{name}-{version}.hz"
        target = TargetFile.from_data(path, data, ["sha256"])
        target.unrecognized_fields["custom"] = {"name": name, "version": version}
        self.targets.targets[path] = target
        self.files[f"targets/{target.hashes['sha256']}.{path}"] = data
        self.next()

    def next(self) -> None:
        """Sign a new state."""
        for signed in (self.targets, self.snapshot, self.timestamp):
            signed.version += 1
        self.sign()

    def sign(self, **signers: CryptoSigner) -> None:
        """Sign the present state, with other keys where a test wants them."""
        used = {**self.signers, **signers}
        data = self._write(f"{self.targets.version}.targets.json", self.targets, "targets", used)
        self.snapshot.meta["targets.json"] = MetaFile.from_data(self.targets.version, data, ["sha256"])
        data = self._write(f"{self.snapshot.version}.snapshot.json", self.snapshot, "snapshot", used)
        self.timestamp.snapshot_meta = MetaFile.from_data(self.snapshot.version, data, ["sha256"])
        self._write("timestamp.json", self.timestamp, "timestamp", used)

    def package_path(self, name: str, version: str) -> str:
        path = f"{name}-{version}.hz"
        return f"targets/{self.targets.targets[path].hashes['sha256']}.{path}"

    def get(self, url: str, write: Writer, limit: int, on_progress: Progress | None) -> None:
        path = url.removeprefix(f"{URL}/")
        self.asked.append((path, limit))
        if self.away:
            raise Unreachable(f"cannot reach {url}: try again later")
        if path not in self.files:
            raise Refused(f"cannot fetch {url}: HTTP 404", 404)
        data = self.files[path]
        if len(data) > limit:
            raise Invalid(f"cannot accept {url}: it is longer than {limit} bytes")
        write(data)
        if on_progress is not None:
            on_progress(len(data), len(data))

    def _write(self, file: str, signed: Any, role: str, signers: dict[str, CryptoSigner] | None = None) -> bytes:
        metadata = Metadata(signed)
        metadata.sign((signers or self.signers)[role])
        self.files[f"metadata/{file}"] = metadata.to_bytes()
        return self.files[f"metadata/{file}"]
