"""How somebody asks to be a publisher whose private key nobody else ever has: their public key, and a list it has signed. Pure.

The list shows that who asks has the private key, and is what the store serves until the first package is handed in (or,
when a key is changed, from then on). The file goes to the platform's owner on a way that both trust, and is no secret.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from securesystemslib.exceptions import UnverifiedSignatureError
from securesystemslib.signer import CryptoSigner, SSlibKey
from tuf.api.exceptions import RepositoryError
from tuf.api.metadata import Metadata, Targets  # type: ignore[attr-defined]  # public, but not in __all__
from tuf.api.serialization import DeserializationError

from rapp_hop import strict_json
from rapp_hop.errors import Invalid
from rapp_hop.hz.standing import LASTS, MAX_LIST, signed
from rapp_hop.hz.text import check_name

MAX_BYTES = 2 * MAX_LIST  # of the file
_FIELDS = {"publisher", "public_key", "list"}


@dataclass(frozen=True)
class Application:
    """Who asks, with which key, and the list it has signed."""

    publisher: str
    key: SSlibKey
    data: bytes  # the signed list
    own: Targets  # what it says


def first_list(after: int = 0) -> Targets:
    """Return an empty list.

    :param after: number of the last one that the store had of this publisher
    """
    return Targets(version=after + 1, expires=(datetime.now(UTC) + LASTS).replace(microsecond=0))


def write_application(publisher: str, signer: CryptoSigner, own: Targets) -> bytes:
    """Return the file."""
    public = signer.public_key.keyval["public"]
    fields = {"publisher": check_name(publisher), "public_key": public, "list": signed(own, signer).decode()}
    return strict_json.dumps(fields).encode()


def read_application(data: bytes) -> Application:
    """Return what such a file says.

    :raises Invalid: when it is broken, or the list was not signed by the key beside it
    """
    found = strict_json.loads(data, limit=MAX_BYTES)
    if not isinstance(found, dict) or set(found) != _FIELDS or not all(isinstance(text, str) for text in found.values()):
        raise Invalid(f"cannot read the application: it must have the texts {', '.join(sorted(_FIELDS))}")
    publisher, listed = check_name(found["publisher"]), found["list"].encode()
    try:
        key: SSlibKey = SSlibKey.from_crypto(Ed25519PublicKey.from_public_bytes(bytes.fromhex(found["public_key"])))
        metadata = Metadata[Any].from_bytes(listed)
        key.verify_signature(metadata.signatures[key.keyid], metadata.signed_bytes)
    except (KeyError, UnverifiedSignatureError):
        raise Invalid(f"cannot take the key of {publisher}: its list is not signed by it, have the file made again") from None
    except (DeserializationError, RepositoryError, ValueError):
        raise Invalid("cannot read the application: its key or list is broken, have the file made again") from None
    if not isinstance(metadata.signed, Targets):
        raise Invalid("cannot read the application: its list is of another kind, have the file made again")
    return Application(publisher, key, listed, metadata.signed)
