"""The store's signing keys: Ed25519, one per TUF role, in a private folder (0700) of files only we can read (0600).

The files are not encrypted yet: password protection and keys kept off the server come with the store's own issue. Until
then whoever can read the platform's data folder can publish.
"""

import os
from collections.abc import Mapping
from pathlib import Path

from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from securesystemslib.signer import CryptoSigner, Signer

from rapp_cloud.files import write_whole
from rapp_hop.errors import Invalid, Refused

ROLES = ("root", "targets", "snapshot", "timestamp")


def make_keys(folder: Path) -> Mapping[str, Signer]:
    """Make a key for each role and keep them.

    :raises Refused: when there are keys already: making new ones would cut off every robot
    """
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    folder.chmod(0o700)
    if any(folder.glob("*.pem")):
        raise Refused(f"cannot make keys in {folder}: there are some, keep them")
    signers = {role: CryptoSigner.generate_ed25519() for role in ROLES}
    for role, signer in signers.items():
        write_whole(folder / f"{role}.pem", signer.private_bytes, mode=0o600)
    return signers


def load_keys(folder: Path) -> Mapping[str, Signer]:
    """Return the signer of each role.

    :raises Refused: when a key is missing or others can read it
    :raises Invalid: when a file is no key
    """
    signers: dict[str, Signer] = {}
    for role in ROLES:
        path = folder / f"{role}.pem"
        try:
            if path.stat().st_mode & 0o077 or path.stat().st_uid != os.geteuid():
                raise Refused(f"cannot use {path}: others can read it, set its mode to 0600")
            signers[role] = _signer(path.read_bytes(), path)
        except OSError as error:
            raise Refused(f"cannot read {path}: {error.strerror}, run rapp_cloud init first") from None
    return signers


def _signer(data: bytes, path: Path) -> Signer:
    try:
        return CryptoSigner(load_pem_private_key(data, None))
    except (ValueError, TypeError, UnsupportedAlgorithm):
        raise Invalid(f"cannot read {path}: it is not a key") from None
