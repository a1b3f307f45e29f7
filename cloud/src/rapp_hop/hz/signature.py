"""A signature beside a package (`<file>.sig`): who vouches for these bytes, outside any store. Pure.

It is TUF targets metadata with the one package in it and the public key beside it; that key is believed only by its id,
which is the hash of the key and comes on another way. A store does not look at it: there its own lists count.
"""

import io
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from securesystemslib.exceptions import UnverifiedSignatureError
from securesystemslib.signer import CryptoSigner, SSlibKey
from tuf.api.exceptions import RepositoryError
from tuf.api.metadata import Metadata, TargetFile, Targets  # type: ignore[attr-defined]  # public, but not in __all__
from tuf.api.serialization import DeserializationError

from rapp_hop.hz.archive import inspect, package_file_name
from rapp_hop.hz.attacks import Attack, Untrusted
from rapp_hop.hz.manifest import Manifest

_KEY = "public_key"
MAX_BYTES = 64 * 1024  # of a signature file


@dataclass(frozen=True)
class Vouched:
    """A package and whose key has signed for it."""

    manifest: Manifest
    keyid: str


def sign_package(package: bytes, signer: CryptoSigner, lasts: timedelta = timedelta(days=365)) -> bytes:
    """Return the signature file of a package.

    :raises Invalid: when it is not a right package
    """
    manifest = inspect(io.BytesIO(package)).manifest
    path = package_file_name(manifest.name, manifest.version.text)
    targets = Targets(expires=(datetime.now(UTC) + lasts).replace(microsecond=0))
    targets.targets[path] = TargetFile.from_data(path, package, ["sha256"])
    targets.unrecognized_fields[_KEY] = signer.public_key.keyval["public"]
    metadata: Metadata[Targets] = Metadata(targets)
    metadata.sign(signer)
    return metadata.to_bytes()


def verify_package(package: bytes, signature: bytes, believed: frozenset[str]) -> Vouched:
    """Return what a package is and whose key has signed it.

    :param believed: ids of the keys that are believed
    :raises Untrusted: naming what is wrong
    :raises Invalid: when it is not a right package
    """
    try:
        metadata = Metadata[Targets].from_bytes(signature[: MAX_BYTES + 1])
        targets = metadata.signed
        public = Ed25519PublicKey.from_public_bytes(bytes.fromhex(str(targets.unrecognized_fields.get(_KEY, ""))))
        key = SSlibKey.from_crypto(public)
        key.verify_signature(metadata.signatures[key.keyid], metadata.signed_bytes)
    except (KeyError, UnverifiedSignatureError):
        raise Untrusted(Attack.UNSIGNED, "cannot trust the package: the signature is not by the key it names") from None
    except (DeserializationError, RepositoryError, ValueError, AttributeError):
        raise Untrusted(Attack.MALFORMED, "cannot trust the package: the signature file is broken") from None
    if key.keyid not in believed:
        raise Untrusted(Attack.UNSIGNED, f"cannot trust the package: it is signed by {key.keyid}, a key nobody has vouched for")
    if targets.is_expired():
        raise Untrusted(Attack.FREEZE, f"cannot trust the package: its signature ran out at {targets.expires:%F}")
    manifest = inspect(io.BytesIO(package)).manifest
    target = targets.targets.get(package_file_name(manifest.name, manifest.version.text))
    if target is None:
        raise Untrusted(Attack.WRONG_CONTENT, "cannot trust the package: the signature is for another one")
    try:
        target.verify_length_and_hashes(package)
    except RepositoryError as error:
        raise Untrusted(Attack.WRONG_CONTENT, f"cannot trust the package: {error}") from None
    return Vouched(manifest, key.keyid)
