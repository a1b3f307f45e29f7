"""Why a package is believed: The Update Framework's client workflow, and a name for each attack it refuses.

Rules (TUF specification §5, kept by `tuf.ngclient.Updater`): the root shipped with the robot is the only thing believed
from the start; a new root is signed by the old one; timestamp, snapshot and targets are signed by the keys that root
names, never older than what was seen, not expired, and fit each other by version, length and hash; a package has the
length and hash that targets gives it. No byte is unpacked before all of this holds.

No network here: bytes come through the port `Transport`. The updater keeps what it has seen in a folder of its own.
Blocking: call it in a thread. One caller at a time (a lock sees to it).
"""

import re
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import IO, Protocol

from tuf.api import exceptions as tuf
from tuf.api.metadata import Metadata, TargetFile, Targets  # type: ignore[attr-defined]  # public, but not in __all__
from tuf.api.serialization import DeserializationError
from tuf.ngclient.config import UpdaterConfig
from tuf.ngclient.fetcher import FetcherInterface
from tuf.ngclient.updater import Updater

from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.hz.archive import package_file_name
from rapp_hop.hz.semver import Version, parse_version
from rapp_hop.hz.tar import Limits
from rapp_hop.hz.text import check_name
from rapp_hop.streaming import Progress, Writer

_MIXED = re.compile(r"Expected (snapshot version \d|\S+ v\d)")  # versions that do not fit each other, not older ones


class Attack(StrEnum):
    """What somebody who holds the line or the mirror may try; the names are TUF's (specification §1.5)."""

    UNSIGNED = "unsigned or signed by a wrong key"
    ROLLBACK = "rollback"
    FREEZE = "freeze"
    MIX_AND_MATCH = "mix-and-match"
    WRONG_CONTENT = "wrong hash or length"
    ENDLESS_DATA = "endless data"
    MALFORMED = "malformed metadata"


class Untrusted(Invalid):
    """The store, or who pretends to be it, cannot be believed; `attack` says what it looks like, and is the `reason`."""

    def __init__(self, attack: Attack, message: str) -> None:
        super().__init__(message)
        self.attack = attack
        self.reason = attack.value


class Transport(Protocol):
    """Brings the bytes of a URL; sizes and times are bounded here, so an implementation does one thing."""

    def get(self, url: str, write: Writer, limit: int, on_progress: Progress | None) -> None:
        """Hand all bytes of `url` to `write` within the transport's time limit.

        :param limit: bytes; more is `Invalid`
        :raises HopError: `Refused` with the HTTP status when the server says no, `Unreachable`, `Invalid`
        """


@dataclass(frozen=True)
class Release:
    """A package that the store's targets role vouches for."""

    name: str
    version: Version
    length: int  # bytes
    target: TargetFile


class TrustedStore:
    """The store as far as it can be believed."""

    def __init__(self, transport: Transport, url: str, root: bytes, folder: Path, limits: Limits | None = None) -> None:
        """Prepare; touches neither disk nor network.

        :param url: base such as http://127.0.0.1:9001/tuf, with metadata/ and targets/ below
        :param root: the trusted root.json that came with the robot
        :param folder: private folder for what was seen (protects against rollback); made when missing
        """
        self._fetcher = _Fetcher(transport)
        self._url = url.rstrip("/")
        self._root = root
        self._folder = folder
        self._limits = limits or Limits()
        self._lock = threading.Lock()

    def releases(self) -> list[Release]:
        """Refresh the metadata and return every package on offer.

        :raises Untrusted: naming the attack
        :raises Unreachable: when the store cannot be reached or is not complete
        """
        with self._lock, _translated(Attack.MIX_AND_MATCH):
            updater = self._updater()
            updater.refresh()
            targets = self._trusted_targets()
            return sorted(
                (release for path, target in targets.items() if (release := _release(path, target))),
                key=lambda release: (release.name, release.version.key),
            )

    def download(self, release: Release, destination: Path, on_progress: Progress | None = None) -> None:
        """Write the package of `release` to `destination`, verified; nothing is written when it is wrong.

        :raises Untrusted: naming the attack
        :raises Unreachable: when the store cannot be reached or the line is cut
        :raises OSError: when the disk refuses
        """
        if release.length > self._limits.packed:
            raise Invalid(f"cannot download {release.name}: {release.length} bytes, {self._limits.packed} are allowed")
        with self._lock, _translated(Attack.WRONG_CONTENT), self._fetcher.watched(on_progress):
            updater = self._updater()
            target = updater.get_targetinfo(release.target.path)
            if target is None:
                raise Refused(f"cannot download {release.name} {release.version}: the store offers it no more")
            if target != release.target:
                raise Unreachable(f"cannot download {release.name}: the store changed meanwhile, try again")
            updater.download_target(target, str(destination))

    def _updater(self) -> Updater:
        self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        return Updater(
            metadata_dir=str(self._folder),
            metadata_base_url=f"{self._url}/metadata/",
            target_base_url=f"{self._url}/targets/",
            fetcher=self._fetcher,
            config=UpdaterConfig(max_root_rotations=32),
            bootstrap=self._root,
        )

    def _trusted_targets(self) -> dict[str, TargetFile]:
        # The updater offers no list; its cache holds the targets role it has just verified.
        return Metadata[Targets].from_bytes((self._folder / "targets.json").read_bytes()).signed.targets


def newest(releases: list[Release], name: str, version: str | None = None) -> Release:
    """Return the release asked for; without a version the newest one, pre-releases only when nothing else is there.

    :raises Refused: when the store has no such package
    """
    found = [item for item in releases if item.name == name and version in (None, item.version.text)]
    if not found:
        raise Refused(f"cannot find {name} {version or ''}".rstrip() + " in the store: ask for the list of RApps")
    return max(found, key=lambda item: ("-" not in item.version.text, item.version.key))


def _release(path: str, target: TargetFile) -> Release | None:
    custom = target.custom or {}
    try:
        name, version = check_name(str(custom.get("name"))), parse_version(str(custom.get("version")))
    except Invalid:
        return None
    if path != package_file_name(name, version.text):
        return None
    return Release(name, version, target.length, target)


class _Fetcher(FetcherInterface):
    """`tuf`'s port on top of ours: the limit is known before the first byte is asked for."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._on_progress: Progress | None = None

    @contextmanager
    def watched(self, on_progress: Progress | None) -> Iterator[None]:
        self._on_progress = on_progress
        try:
            yield
        finally:
            self._on_progress = None

    def _fetch(self, url: str) -> Iterator[bytes]:
        raise tuf.DownloadError(f"cannot fetch {url} without a limit")

    @contextmanager
    def download_file(self, url: str, max_length: int) -> Iterator[IO[bytes]]:
        with tempfile.TemporaryFile() as file:
            on_progress = None if "/metadata/" in url else self._on_progress
            try:
                self._transport.get(url, file.write, max_length, on_progress)
            except (Refused, Bug) as error:
                raise tuf.DownloadHTTPError(str(error), error.status or 403) from None
            except Invalid as error:
                raise tuf.DownloadLengthMismatchError(str(error)) from None
            except Unreachable as error:
                raise tuf.DownloadError(str(error)) from None
            file.seek(0)
            yield file


@contextmanager
def _translated(misfit: Attack) -> Iterator[None]:
    """Turn `tuf`'s exceptions into ours, once; `misfit` names what bytes with a wrong hash or length mean here."""
    try:
        yield
    except HopError:
        raise
    except tuf.DownloadLengthMismatchError as error:
        raise _untrusted(Attack.ENDLESS_DATA, error) from None
    except tuf.DownloadHTTPError as error:
        raise Unreachable(f"cannot use the store now: {error}", error.status_code) from None
    except tuf.DownloadError as error:
        raise Unreachable(str(error)) from None
    except (tuf.RepositoryError, DeserializationError) as error:
        raise _untrusted(_attack(error, misfit), error) from None


def _attack(error: Exception, misfit: Attack) -> Attack:
    if isinstance(error, tuf.UnsignedMetadataError):
        return Attack.UNSIGNED
    if isinstance(error, tuf.ExpiredMetadataError):
        return Attack.FREEZE
    if isinstance(error, tuf.BadVersionNumberError):
        return Attack.MIX_AND_MATCH if _MIXED.match(str(error)) else Attack.ROLLBACK
    return misfit if isinstance(error, tuf.LengthOrHashMismatchError) else Attack.MALFORMED


def _untrusted(attack: Attack, error: Exception) -> Untrusted:
    return Untrusted(attack, f"cannot trust the store ({attack}): {error}, nothing was installed")
