"""The store's signing keys: Ed25519, one file per role and publisher, encrypted with one passphrase.

The folder is ours alone (0700), its files too (0600). The passphrase comes from a file or from the environment; where
nobody has chosen one, it is made at random beside the keys, so that a platform starts unattended. Then a copy of the
keys alone is worth nothing, but who reads the whole folder can sign: keep the passphrase elsewhere, and the keys of
root, targets and publishers too, which are needed only to publish and to change keys.
"""

import os
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    PrivateFormat,
    load_pem_private_key,
)
from securesystemslib.signer import CryptoSigner

from rapp_cloud.files import write_whole
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.text import check_name

ROLES = ("root", "targets", "snapshot", "timestamp")
ROOTS = ("root", *(f"root_{number}" for number in range(2, 10)))  # the root may have several keys
BESIDE = "passphrase"  # the file beside the keys
PASSPHRASE, PASSPHRASE_FILE = "RAPP_CLOUD_PASSPHRASE", "RAPP_CLOUD_PASSPHRASE_FILE"
_SHORTEST = 16  # characters of a passphrase: PKCS 8 makes guessing hardly slower
_LONGEST = 1024  # bytes


@dataclass(frozen=True)
class Passphrase:
    """Where the passphrase is; None and None: beside the keys."""

    text: str | None = None
    file: Path | None = None

    def __repr__(self) -> str:
        return "Passphrase(...)"


def passphrase_from(environment: Mapping[str, str], file: Path | None = None) -> Passphrase:
    """Return what the environment, or an option that goes before it, says."""
    if file is None and environment.get(PASSPHRASE_FILE):
        file = Path(environment[PASSPHRASE_FILE])
    return Passphrase(None if file else environment.get(PASSPHRASE) or None, file)


class KeyRing:
    """The keys of one store. Blocking; changes happen under the store's lock."""

    def __init__(self, folder: Path, passphrase: Passphrase | None = None) -> None:
        """Remember the place; reads nothing yet."""
        self.folder = folder
        self._passphrase = passphrase or Passphrase()

    def names(self) -> list[str]:
        """Return whose keys are here."""
        return sorted(path.stem for path in self.folder.glob("*.pem"))

    def has(self, name: str) -> bool:
        """Tell whether a key is here."""
        return self._path(name).exists()

    def new(self, name: str) -> CryptoSigner:
        """Make a key that is not kept yet."""
        check_name(name)
        return CryptoSigner(Ed25519PrivateKey.generate())

    def keep(self, name: str, signer: CryptoSigner) -> None:
        """Keep a key, in the place of the one that was there."""
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        self.folder.chmod(0o700)
        data = self._encrypted(signer)
        write_whole(self._path(name), data, mode=0o600)

    def signer(self, name: str) -> CryptoSigner:
        """Return the key of a role or publisher.

        :raises Refused: when it is missing, others can read it, or the passphrase is another
        :raises Invalid: when the file is no key
        """
        path = self._path(name)
        try:
            status = path.stat()
            if status.st_mode & 0o077 or status.st_uid != os.geteuid():
                raise Refused(f"cannot use {path}: others can read it, set its mode to 0600")
            return self._open(path, path.read_bytes())
        except OSError as error:
            raise Refused(f"cannot read {path}: {error.strerror}, bring the key there or run rapp_cloud init") from None

    def remove(self, name: str) -> None:
        """Throw a key away; nothing when it is not here."""
        self._path(name).unlink(missing_ok=True)

    def encrypt_all(self) -> list[str]:
        """Encrypt keys that an earlier version kept in the clear; return whose."""
        plain = [name for name in self.names() if b"BEGIN PRIVATE KEY" in self._path(name).read_bytes()]
        for name in plain:
            self.keep(name, self.signer(name))
        return plain

    def _path(self, name: str) -> Path:
        return self.folder / f"{check_name(name)}.pem"

    def _open(self, path: Path, data: bytes) -> CryptoSigner:
        word = None if b"BEGIN PRIVATE KEY" in data else self._word()
        try:
            return CryptoSigner(load_pem_private_key(data, word))
        except (ValueError, TypeError, UnsupportedAlgorithm) as error:
            if word is not None and "decrypt" in str(error).lower():
                raise Refused(f"cannot open {path}: the passphrase is another, see {PASSPHRASE_FILE}") from None
            raise Invalid(f"cannot read {path}: it is not a key") from None

    def _encrypted(self, signer: CryptoSigner) -> bytes:
        key = load_pem_private_key(signer.private_bytes, None)
        return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, BestAvailableEncryption(self._word(make=True)))

    def _word(self, *, make: bool = False) -> bytes:
        if self._passphrase.text is not None:
            return _checked(self._passphrase.text.encode(), PASSPHRASE)
        path = self._passphrase.file or self.folder / BESIDE
        if make and self._passphrase.file is None and not path.exists() and self._all_plain():
            write_whole(path, secrets.token_urlsafe(32).encode(), mode=0o600)
        try:
            if path.stat().st_mode & 0o077:
                raise Refused(f"cannot use {path}: others can read it, set its mode to 0600")
            with path.open("rb") as file:
                return _checked(file.read(_LONGEST).strip(), str(path))
        except OSError as error:
            raise Refused(f"cannot read the passphrase {path}: {error.strerror}, name its file in {PASSPHRASE_FILE}") from None

    def _all_plain(self) -> bool:
        """Whether no key is locked yet, so that a new passphrase locks nobody out."""
        return not any(b"BEGIN ENCRYPTED" in path.read_bytes() for path in self.folder.glob("*.pem"))


def _checked(word: bytes, where: str) -> bytes:
    if len(word) < _SHORTEST:
        raise Refused(f"cannot use the passphrase of {where}: it must have {_SHORTEST} characters or more")
    return word
