"""A store on another computer, as its publishers use it: looked at as a robot does, changed by lists signed here.

What a publisher has at home lies in `HOME/publisher`: the private key, encrypted, and what was seen of the store (against
rollback). The platform gives them a token and its root; a token is never a word of a command.
"""

import argparse
import asyncio
import hashlib
import itertools
import logging
import os
import re
import ssl
import tempfile
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import Metadata, Root  # type: ignore[attr-defined]  # public, but not in __all__
from tuf.api.serialization import DeserializationError

from rapp_cli.cloud import check_url
from rapp_cli.errors import UsageError
from rapp_cli.home.place import home_of
from rapp_cloud.keys import KeyRing, passphrase_from
from rapp_hop.client import HopClient
from rapp_hop.errors import Refused
from rapp_hop.hz.standing import Standing
from rapp_hop.hz.transport import DeliveryLimits, LoopTransport
from rapp_hop.hz.trust import Release, TrustedStore, Versions

PATIENCE = 60.0  # s for a list
PUBLISHING = 300.0  # s for a package
MAX_TOKEN = 300  # bytes of its file
MAX_ROOT = 512_000  # bytes, as TUF's clients have it
UNAUTHORIZED = 401  # HTTP status
NEXT = "next_"  # begin of the name of a key that the store does not know yet
T = TypeVar("T")


@dataclass(frozen=True)
class Remote:
    """A platform, and what this computer knows of it."""

    url: str
    root: bytes
    token: str | None
    ca_file: Path | None
    folder: Path  # the publisher's own


class RemoteStore:
    """The store behind an open connection."""

    def __init__(self, remote: Remote, client: HopClient) -> None:
        self._client = client
        transport = LoopTransport(client, asyncio.get_running_loop(), DeliveryLimits())
        seen = remote.folder / "seen" / hashlib.sha256(remote.root).hexdigest()[:16]
        self._store = TrustedStore(transport, f"{client.base_url}/tuf", remote.root, seen)

    async def standing(self, publisher: str) -> Standing:
        """Return how a publisher stands.

        :raises Refused: when they have no key or no name there
        """
        found = await asyncio.to_thread(self._store.standings, publisher)
        if not found:
            text = f"cannot publish as {publisher}: the store knows no key or no name of theirs"
            new = f"./rapp keys new {publisher} --public FILE (made by ./rapp keys own) and ./rapp keys grant {publisher} RAPP"
            raise Refused(f"{text}; ask who keeps the platform for {new}")
        return found[0]

    async def standings(self) -> list[Standing]:
        """Return how all publishers stand who have a name."""
        return await asyncio.to_thread(self._store.standings)

    async def versions(self, name: str) -> Versions:
        """Return all that is on offer under a name."""
        return await asyncio.to_thread(self._store.versions, name)

    async def download(self, release: Release, path: Path) -> None:
        """Write a package to a file, verified."""
        await asyncio.to_thread(self._store.download, release, path)

    async def publish(self, package: bytes, signed_list: bytes, *, check: bool) -> None:
        """Hand in a package with its list; with `check`, only ask whether it could be."""
        files = {"package": package, "signed_list": signed_list}
        await self._send("publish_package", files, {"check": check}, PUBLISHING)

    async def replace(self, signed_list: bytes) -> None:
        """Hand in a list."""
        await self._send("publish_list", {"signed_list": signed_list}, {}, PATIENCE)

    async def _send(self, service: str, contents: Mapping[str, bytes], arguments: Mapping[str, Any], timeout: float) -> None:
        with tempfile.TemporaryDirectory() as folder:
            files = {name: Path(folder, name) for name in contents}
            for name, path in files.items():
                path.write_bytes(contents[name])
            try:
                await self._client.call(service, arguments, files, timeout)
            except Refused as error:
                if error.status != UNAUTHORIZED:
                    raise
                ask = "ask who keeps the platform for another (./rapp cloud token NAME FILE)"
                raise Refused(f"cannot hand in: the platform does not take the token of RAPP_TOKEN_FILE, {ask}") from None


def add_cloud_option(parser: argparse.ArgumentParser) -> None:
    """The option that names a platform elsewhere."""
    parser.add_argument(
        "--cloud", metavar="URL", help="of a platform elsewhere, such as https://rapp.example:9001; its token is in the file "
        "RAPP_TOKEN_FILE, its root in RAPP_ROOT_FILE, a certificate of its own in RAPP_CLOUD_CA_FILE",
    )  # fmt: skip


def remote_of(options: argparse.Namespace, environment: Mapping[str, str] = os.environ, *, token: bool = True) -> Remote:
    """Return the platform that the options and the environment name. Raises UsageError saying what is missing."""
    url = check_url(options.cloud)
    files = {name: Path(environment[name]).expanduser() for name in environment if name in ("RAPP_TOKEN_FILE", "RAPP_ROOT_FILE")}
    for name in ("RAPP_ROOT_FILE", *(("RAPP_TOKEN_FILE",) if token else ())):
        if name not in files:
            raise UsageError(f"cannot use {url} without {name}: set it to the file that the platform's owner gave")
    ca_file = Path(environment["RAPP_CLOUD_CA_FILE"]).expanduser() if environment.get("RAPP_CLOUD_CA_FILE") else None
    if ca_file is not None:
        _check_certificate(ca_file)
    secret = _token(files["RAPP_TOKEN_FILE"]) if token else None
    return Remote(url, _root(files["RAPP_ROOT_FILE"]), secret, ca_file, folder_of(options))


def folder_of(options: argparse.Namespace) -> Path:
    """The folder of what a publisher has at home."""
    return home_of(options).folder / "publisher"


def ring_of(folder: Path) -> KeyRing:
    """The keys that a publisher has at home."""
    return KeyRing(folder / "keys", passphrase_from(os.environ))


def publisher_of(ring: KeyRing, wanted: str | None) -> str:
    """Return who publishes from here. Raises UsageError when that is not clear."""
    names = [name for name in ring.names() if not name.startswith(NEXT)]
    if wanted is None and len(names) == 1:
        return names[0]
    if wanted is None or wanted not in names:
        raise UsageError(f"cannot sign as {wanted or 'nobody'}: keys here are {', '.join(names) or 'none'}, see ./rapp keys own")
    return wanted


def free_place(ring: KeyRing, name: str) -> str:
    """Return where to keep one more key that the store does not know yet: the owner may have the file of each earlier one."""
    places = (f"{NEXT}{number}_{name}" if number > 1 else NEXT + name for number in itertools.count(1))
    return next(place for place in places if not ring.has(place))


def signer_of(ring: KeyRing, standing: Standing) -> CryptoSigner:
    """Return the key by which the store knows a publisher, which may be one that was new until now.

    :raises Refused: when it is not here
    """
    name = standing.publisher
    for kept in filter(re.compile(rf"{NEXT}(\d+_)?{name}").fullmatch, ring.names()):
        if (signer := ring.signer(kept)).public_key.keyid in standing.role.keyids:
            ring.keep(name, signer)
            ring.remove(kept)
    signer = ring.signer(name)
    if signer.public_key.keyid not in standing.role.keyids:
        known = ", ".join(standing.role.keyids)
        raise Refused(f"cannot sign as {name}: the store knows key {known}, here is {signer.public_key.keyid}")
    return signer


def with_store(remote: Remote, work: Callable[[RemoteStore], Coroutine[Any, Any, T]]) -> T:
    """Do something with the store, connected; returns what it gives."""

    async def connected() -> T:
        async with _connected(remote) as store:
            return await work(store)

    logging.getLogger("tornado.general").setLevel(logging.ERROR)  # what it warns of, our own errors say
    return asyncio.run(connected())


@asynccontextmanager
async def _connected(remote: Remote) -> AsyncIterator[RemoteStore]:
    client = HopClient(remote.url, remote.token, ca_file=remote.ca_file)
    try:
        yield RemoteStore(remote, client)
    finally:
        await client.close()


def _token(path: Path) -> str:
    if path.stat().st_mode & 0o077:
        raise UsageError(f"cannot use {path}: others can read it, set its mode to 0600")
    with path.open("rb") as file:
        text = file.read(MAX_TOKEN).strip().decode(errors="replace")
    if not (text.isascii() and text.isprintable() and text):
        raise UsageError(f"cannot use {path}: it holds no token, name the right file in RAPP_TOKEN_FILE")
    return text


def _root(path: Path) -> bytes:
    with path.open("rb") as file:
        data = file.read(MAX_ROOT)
    try:
        Metadata[Root].from_bytes(data)
    except DeserializationError:
        raise UsageError(f"cannot use {path}: it is no root.json of a store, name the right file in RAPP_ROOT_FILE") from None
    return data


def _check_certificate(path: Path) -> None:
    try:
        ssl.create_default_context(cafile=path)
    except ssl.SSLError:
        raise UsageError(f"cannot use {path}: it is no certificate, name the right file in RAPP_CLOUD_CA_FILE") from None
    except OSError as error:
        raise UsageError(f"cannot use {path}: {error.strerror}, name the right file in RAPP_CLOUD_CA_FILE") from None
