"""A publisher's list as it stands in a store, and the one that is to follow: what an author signs, and a platform judges. Pure.

Targets, which the platform's owner signs, says whose keys and package names are whose; each publisher's own list (a TUF
delegated role) holds hashes and lengths of their packages. Yanked packages stay in it by their hashes.
"""

import copy
import hashlib
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import DelegatedRole, Metadata, TargetFile, Targets  # type: ignore[attr-defined]  # not in __all__

from rapp_hop.errors import Refused
from rapp_hop.hz.archive import package_file_name
from rapp_hop.hz.manifest import Manifest

YANKED = "yanked"  # in a publisher's list: packages that were taken off offer, hashes by path
KNOWN = "known"  # in targets, by publisher: packages of lists from before a key was revoked, hashes by path
REVOKED = "revoked"  # in targets: publishers whose key was revoked, with their keys and names
MAX_LIST = 4_000_000  # bytes of a signed list; TUF's clients take 5 000 000
RESTORED = "restored"  # in targets: when the store came back out of a back-up, without what was newer
LASTS = timedelta(days=365)  # that the word of a publisher who keeps their own key is good


@dataclass(frozen=True)
class Standing:
    """One publisher in one store, as the signed lists have it."""

    publisher: str
    targets: Targets  # the delegating list
    own: Targets  # the publisher's list

    @property
    def role(self) -> DelegatedRole:
        """The publisher's keys and names."""
        assert self.targets.delegations is not None and self.targets.delegations.roles is not None
        return self.targets.delegations.roles[self.publisher]

    @property
    def known(self) -> dict[str, str]:
        """Hashes of all packages that were ever on offer, by path."""
        before = self.targets.unrecognized_fields.get(KNOWN, {}).get(self.publisher, {})
        return {**before, **yanked_of(self.own), **{path: target.hashes["sha256"] for path, target in self.own.targets.items()}}

    def with_package(self, manifest: Manifest, package: bytes, robots: tuple[str, ...] = ()) -> Targets | None:
        """Return the next list with a package in it; None: it is on offer with these bytes.

        :param robots: names of the only robots it is for; none: all
        :raises Refused: when the name is not this publisher's, or the version was published with other bytes (S20)
        """
        name, path = manifest.name, package_file_name(manifest.name, manifest.version.text)
        check_own(self, name)
        if self.known.get(path) not in (None, hashlib.sha256(package).hexdigest()):
            raise Refused(f"cannot publish {path}: published with other bytes before, raise its version")
        if path in self.own.targets:
            return None
        target = TargetFile.from_data(path, package, ["sha256"])
        target.unrecognized_fields["custom"] = custom_of(manifest, robots)
        return self._next({**self.own.targets, path: target})

    def without(self, name: str, version: str) -> Targets:
        """Return the next list with a package taken off offer.

        :raises Refused: when it is not on offer
        """
        path = package_file_name(name, version)
        if path not in self.own.targets:
            raise Refused(f"cannot yank {name} {version}: {self.publisher} has none on offer, see ./rapp store list")
        return self._next({kept: target for kept, target in self.own.targets.items() if kept != path})

    def renewed(self) -> Targets:
        """Return the same list once more, good for longer."""
        return self._next(self.own.targets)

    def _next(self, offered: dict[str, TargetFile]) -> Targets:
        found = copy.deepcopy(self.own)
        found.targets = copy.deepcopy(offered)
        found.version += 1
        found.expires = (datetime.now(UTC) + LASTS).replace(microsecond=0)
        gone = {path: digest for path, digest in self.known.items() if path not in offered}
        found.unrecognized_fields = {YANKED: gone} if gone else {}
        return found


def check_own(standing: Standing, name: str) -> None:
    """Check that a package name is this publisher's.

    :raises Refused: with who can change that
    """
    if pattern(name) not in (standing.role.paths or ()):
        who = standing.publisher
        ask = f"ask who keeps the platform for ./rapp keys grant {who} {name}"
        raise Refused(f"cannot publish {name} as {who}: the name is not theirs, {ask}")


def signed(targets: Targets, signer: CryptoSigner) -> bytes:
    """Return a list as it goes to a store."""
    metadata: Metadata[Any] = Metadata(targets)
    metadata.sign(signer)
    return metadata.to_bytes()


def revoked_names(targets: Targets) -> frozenset[str]:
    """Return the packages that belong to publishers without a key, by the delegating list."""
    return frozenset(name for entry in targets.unrecognized_fields.get(REVOKED, {}).values() for name in entry["names"])


def yanked_of(targets: Targets) -> dict[str, str]:
    """Return the hashes of a list's packages that were taken off offer, by path."""
    return dict(targets.unrecognized_fields.get(YANKED, {}))


def custom_of(manifest: Manifest, robots: tuple[str, ...]) -> dict[str, object]:
    """Return what a list says of a package beside length and hash."""
    custom: dict[str, object] = {"name": manifest.name, "version": manifest.version.text}
    return {**custom, "robots": list(robots)} if robots else custom


def pattern(name: str) -> str:
    """Return TUF's path pattern of all versions of a package."""
    return f"{name}-*.hz"


def package_of(path: str) -> str:
    """Return the package that a pattern of ours stands for."""
    return path.removesuffix("-*.hz")
