"""A TUF repository in memory with a life of its own: publish, expire, swap keys, and play the attacker's tricks."""

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import DelegatedRole, Delegations, Metadata, MetaFile, Root, Snapshot, TargetFile, Targets, Timestamp

from rapp_hop.errors import Invalid, Refused, Unreachable
from rapp_hop.hz.trust import SIGNED_AT
from rapp_hop.streaming import Progress, Writer

ROLES = ("root", "targets", "snapshot", "timestamp")
PUBLISHER = "rapp"
URL = "http://store.example/tuf"
LASTS = timedelta(days=30)


class Repository:
    """Implements the port `rapp_hop.hz.trust.Transport`; `files` is what the line delivers, free to be tampered with."""

    def __init__(self) -> None:
        self.signers = {role: CryptoSigner.generate_ed25519() for role in (*ROLES, PUBLISHER)}
        self.now = datetime.now(UTC).replace(microsecond=0)  # what the store's clock says
        later = self.now + LASTS
        self.root, self.targets = Root(expires=later), Targets(expires=later)
        self.snapshot, self.timestamp = Snapshot(expires=later), Timestamp(expires=later)
        self.targets.delegations = Delegations({}, {})
        self.publishers: dict[str, Targets] = {}
        for role in ROLES:
            self.root.add_key(self.signers[role].public_key, role)
        self.add_publisher(PUBLISHER, "hello", "parrot")
        self.files: dict[str, bytes] = {}
        self.asked: list[tuple[str, int]] = []
        self.away = False
        self.write_root()
        self.sign()

    @property
    def trusted_root(self) -> bytes:
        return self.files["metadata/1.root.json"]

    @property
    def lists(self) -> dict[str, Any]:
        """All that is signed at every change."""
        return {**self.publishers, "targets": self.targets, "snapshot": self.snapshot, "timestamp": self.timestamp}

    def add_publisher(self, name: str, *packages: str) -> None:
        signer = self.signers.setdefault(name, CryptoSigner.generate_ed25519())
        assert self.targets.delegations is not None and self.targets.delegations.roles is not None
        paths = [f"{package}-*.hz" for package in packages]
        self.targets.delegations.roles[name] = DelegatedRole(name, [], 1, True, paths)
        self.targets.add_key(signer.public_key, name)
        self.publishers[name] = Targets(expires=self.now + LASTS)

    def publish(self, name: str, version: str, data: bytes, publisher: str = PUBLISHER, **custom: Any) -> None:
        path = f"{name}-{version}.hz"
        target = TargetFile.from_data(path, data, ["sha256"])
        target.unrecognized_fields["custom"] = {"name": name, "version": version, **custom}
        self.publishers[publisher].targets[path] = target
        self.files[f"targets/{target.hashes['sha256']}.{path}"] = data
        self.next()

    def next(self) -> None:
        """Sign a new state."""
        for signed in self.lists.values():
            signed.version += 1
        self.sign()

    def sign(self, unsigned: str = "", **signers: CryptoSigner) -> None:
        """Sign the present state, with other keys where a test wants them, one list not at all."""
        used: dict[str, Any] = {**self.signers, **signers, unsigned: None}
        for name in (*self.publishers, "targets"):
            signed = self.lists[name]
            data = self._write(f"{signed.version}.{name}.json", signed, used[name])
            self.snapshot.meta[f"{name}.json"] = MetaFile.from_data(signed.version, data, ["sha256"])
        data = self._write(f"{self.snapshot.version}.snapshot.json", self.snapshot, used["snapshot"])
        self.timestamp.snapshot_meta = MetaFile.from_data(self.snapshot.version, data, ["sha256"])
        self.timestamp.unrecognized_fields[SIGNED_AT] = self.now.isoformat()
        self._write("timestamp.json", self.timestamp, used["timestamp"])

    def new_key(self, role: str) -> CryptoSigner:
        """Give a role of root another key, without signing anything; returns the old one."""
        old, self.signers[role] = self.signers[role], CryptoSigner.generate_ed25519()
        self.root.revoke_key(old.public_key.keyid, role)
        self.root.add_key(self.signers[role].public_key, role)
        return old

    def write_root(self, *signers: CryptoSigner) -> None:
        self._write(f"{self.root.version}.root.json", self.root, *(signers or (self.signers["root"],)))

    def package_path(self, name: str, version: str, publisher: str = PUBLISHER) -> str:
        path = f"{name}-{version}.hz"
        return f"targets/{self.publishers[publisher].targets[path].hashes['sha256']}.{path}"

    def get(self, url: str, write: Writer, limit: int, on_progress: Progress | None, start: int = 0) -> None:
        path = url.removeprefix(f"{URL}/")
        self.asked.append((path, limit))
        if self.away:
            raise Unreachable(f"cannot reach {url}: try again later")
        if path not in self.files:
            raise Refused(f"cannot fetch {url}: HTTP 404", 404)
        data = self.files[path]
        if len(data) > limit:
            raise Invalid(f"cannot accept {url}: it is longer than {limit} bytes")
        write(data[start:])
        if on_progress is not None:
            on_progress(len(data), len(data))

    def _write(self, file: str, signed: Any, *signers: CryptoSigner | None) -> bytes:
        metadata = Metadata(signed)
        for signer in filter(None, signers):
            metadata.sign(signer, append=True)
        self.files[f"metadata/{file}"] = metadata.to_bytes()
        return self.files[f"metadata/{file}"]


class Client:
    """As much of `HopClient` as a delivery asks for, with a repository at the other end of the line."""

    base_url = URL.removesuffix("/tuf")

    def __init__(self, repository: Repository) -> None:
        self._repository = repository
        self.before: Callable[[str, Writer], Any] | None = None  # awaited before each answer

    async def download(
        self, path: str, destination: Writer, limit: int, timeout: float = 60.0, on_progress: Progress | None = None,
        start: int = 0,
    ) -> int:  # fmt: skip
        if self.before is not None:
            await self.before(path, destination)
        await asyncio.sleep(0)
        self._repository.get(path, destination, limit, on_progress, start)
        return 0
