"""Why a package is believed: The Update Framework's client workflow, and a name for each attack it refuses.

Rules (TUF specification §5, kept by `tuf.ngclient.Updater`): the root shipped with the robot is the only thing believed
from the start; a new root is signed by the old one; timestamp, snapshot and targets are signed by the keys that root
names, never older than what was seen, not expired, and fit each other by version, length and hash; targets says which
publisher's list a package's name belongs to, and that list gives its length and hash. No byte is unpacked before all of
this holds. Beyond TUF: the timestamp says when it was signed, so that a clock that went back is noticed, and a package
may be for some robots only.

No network here: bytes come through the port `Transport`. The updater keeps what it has seen in a folder of its own.
Blocking: call it in a thread. One caller at a time (locks see to it).
"""

import os
import threading
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import IO, Any, Protocol
from urllib.parse import quote

from tuf.api import exceptions as tuf
from tuf.api.metadata import Metadata, Snapshot, TargetFile, Targets, Timestamp  # type: ignore[attr-defined]  # public, but not in __all__
from tuf.ngclient.config import UpdaterConfig
from tuf.ngclient.fetcher import FetcherInterface
from tuf.ngclient.updater import Updater

from rapp_hop.errors import Bug, Invalid, Refused, Unreachable
from rapp_hop.hz.archive import package_file_name
from rapp_hop.hz.attacks import Attack, Away, Untrusted, translated, untrusted
from rapp_hop.hz.downloads import partial
from rapp_hop.hz.lock import held
from rapp_hop.hz.semver import Version, parse_version
from rapp_hop.hz.standing import KNOWN, RESTORED, YANKED, Standing, revoked_names
from rapp_hop.hz.tar import Limits
from rapp_hop.hz.text import check_name
from rapp_hop.streaming import Progress, Writer

__all__ = ["SIGNED_AT", "YANKED", "Attack", "Release", "Transport", "TrustedStore", "Untrusted", "Versions", "choose"]

SIGNED_AT = "signed_at"  # in the timestamp: when it was signed, ISO 8601
CLOCK_TOLERANCE = timedelta(hours=1)  # by which the robot's clock may be behind the store's
_ROOTS = 256  # that follow the one which came with the robot; a restored store writes several
_PATIENCE = 60.0  # seconds for another process that looks at the store


class Transport(Protocol):
    """Brings the bytes of a URL; sizes and times are bounded here, so an implementation does one thing."""

    def get(self, url: str, write: Writer, limit: int, on_progress: Progress | None, start: int = 0) -> None:
        """Hand all bytes of `url` to `write` within the transport's time limit.

        :param limit: bytes of the whole; more is `Invalid`
        :param start: bytes that are here already: only what follows is handed over
        :raises HopError: `Refused` with the HTTP status when the server says no, `Unreachable`, `Invalid`
        """


@dataclass(frozen=True)
class Release:
    """A package that a publisher of the store vouches for."""

    name: str
    version: Version
    length: int  # bytes
    target: TargetFile
    robots: tuple[str, ...] = ()  # names of those it is for; none: all


@dataclass(frozen=True)
class Versions:
    """All that the store says of one package name."""

    releases: tuple[Release, ...]  # in order
    yanked: frozenset[str]  # versions taken off offer
    restored: bool = False  # the store came back out of a back-up, and may not know versions that it offered after it
    revoked: bool = False  # their publisher has no key any more


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

    def versions(self, name: str) -> Versions:
        """Refresh the metadata and return what is on offer under a name.

        :raises Untrusted: naming the attack
        :raises Unreachable: when the store cannot be reached or is not complete
        """
        with self._refreshed() as updater:
            releases, yanked = [], set()
            lists = self._lists(updater, f"{check_name(name)}-0.hz")
            for targets in lists:
                found = [_release(path, target) for path, target in targets.targets.items()]
                releases += [item for item in found if item is not None and item.name == name]
                yanked |= _yanked(targets, name)
            restored = RESTORED in lists[0].unrecognized_fields
            revoked = name in revoked_names(lists[0])
            return Versions(tuple(sorted(releases, key=lambda item: item.version.key)), frozenset(yanked), restored, revoked)

    def revoked(self, installed: Mapping[str, Collection[str]]) -> frozenset[str]:
        """Refresh the metadata and return the RApps of which nobody vouches for a version, because a key was revoked.

        That of their publisher, who has none now, or one from before the present one; what was only yanked is not meant.

        :param installed: versions by name
        :raises Untrusted: naming the attack
        :raises Unreachable: when the store cannot be reached or is not complete
        """
        with self._refreshed() as updater:
            targets = self._cached("targets", Targets)
            found = set(revoked_names(targets) & installed.keys())
            paths = {package_file_name(name, version): name for name, versions in installed.items() for version in versions}
            for publisher, known in targets.unrecognized_fields.get(KNOWN, {}).items():
                if suspects := [path for path in paths if path in known]:
                    own = self._newest(updater, targets, publisher, suspects[0])
                    found |= {paths[path] for path in suspects if path not in own.targets}
            return frozenset(found)

    def standings(self, publisher: str | None = None) -> list[Standing]:
        """Refresh the metadata and return how publishers stand who have a name, all lists verified; lists may have expired.

        :param publisher: only this one; None: all
        :raises Untrusted: naming the attack
        :raises Unreachable: when the store cannot be reached or is not complete
        """
        with self._refreshed() as updater:
            targets = self._cached("targets", Targets)
            roles = (targets.delegations.roles or {}) if targets.delegations else {}
            named = [(name, role.paths[0]) for name, role in roles.items() if role.paths and publisher in (None, name)]
            return [Standing(name, targets, self._newest(updater, targets, name, path.replace("*", "0"))) for name, path in named]

    def download(self, release: Release, destination: Path, on_progress: Progress | None = None) -> None:
        """Write the package of `release` to `destination`, verified as a whole; nothing is left when it is wrong.

        What has come stays when the line breaks, and the next download to the same destination goes on from it.

        :raises Untrusted: naming the attack
        :raises Unreachable: when the store cannot be reached or the line is cut
        :raises OSError: when the disk refuses
        """
        if release.length > self._limits.packed:
            raise Invalid(f"cannot download {release.name}: {release.length} bytes, {self._limits.packed} are allowed")
        with self._lock, translated(Attack.WRONG_CONTENT), self._fetcher.watched(on_progress, destination):
            with self._alone():
                updater = self._updater()
                target = updater.get_targetinfo(release.target.path)
            if target is None:
                raise Refused(f"cannot download {release.name} {release.version}: the store offers it no more")
            if target != release.target:
                raise Unreachable(f"cannot download {release.name}: the store changed meanwhile, try again")
            resumed = destination.exists()
            try:
                updater.download_target(target, os.devnull)  # what it verifies lies in `destination` already
            except tuf.RepositoryError:
                if not resumed:
                    raise
                updater.download_target(target, os.devnull)  # what was here of it may be to blame

    @contextmanager
    def _refreshed(self) -> Iterator[Updater]:
        with self._lock, translated(Attack.MIX_AND_MATCH), self._alone():
            updater = self._updater()
            updater.refresh()
            self._check_clock()
            yield updater

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Hold the folder of what was seen; another process may install too."""
        self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        with held(self._folder / ".lock", "look at the store", _PATIENCE):
            yield

    def _updater(self) -> Updater:
        return Updater(
            metadata_dir=str(self._folder),
            metadata_base_url=f"{self._url}/metadata/",
            target_base_url=f"{self._url}/targets/",
            fetcher=self._fetcher,
            config=UpdaterConfig(max_root_rotations=_ROOTS),
            bootstrap=self._root,
        )

    def _lists(self, updater: Updater, path: str) -> list[Targets]:
        """Return the lists that may hold `path`, verified: targets, then those of the publishers it is delegated to."""
        updater.get_targetinfo(path)  # no such version is ever there, so this loads every list on the way
        found = [self._cached("targets", Targets)]
        for name, terminating in found[0].delegations.get_roles_for_target(path) if found[0].delegations else ():
            found.append(self._cached(name, Targets))
            if terminating:
                break
        return found

    def _newest(self, updater: Updater, targets: Targets, publisher: str, path: str) -> Targets:
        """Return a publisher's list, verified, also one that has expired: without it they could not sign the next one."""
        try:
            return self._lists(updater, path)[-1]
        except tuf.ExpiredMetadataError:
            meta = self._cached("snapshot", Snapshot).meta[f"{publisher}.json"]
            url = f"{self._url}/metadata/{meta.version}.{publisher}.json"
            data = self._fetcher.download_bytes(url, meta.length or updater.config.targets_max_length)
            meta.verify_length_and_hashes(data)
            metadata = Metadata[Targets].from_bytes(data)
            targets.verify_delegate(publisher, metadata.signed_bytes, metadata.signatures)
            return metadata.signed

    def _check_clock(self) -> None:
        """Without a right clock no expiry means anything."""
        text = self._cached("timestamp", Timestamp).unrecognized_fields.get(SIGNED_AT)
        if text is None:
            return
        try:
            signed = datetime.fromisoformat(str(text))
            wrong = datetime.now(UTC) < signed - CLOCK_TOLERANCE
        except (ValueError, TypeError):
            raise untrusted(Attack.MALFORMED, f"{SIGNED_AT} is no time") from None
        if wrong:
            raise untrusted(Attack.CLOCK, f"the robot's clock says {datetime.now(UTC):%F %R}, the store signed at {signed:%F %R}")

    def _cached(self, role: str, kind: type[Any]) -> Any:
        # The updater offers no lists; its cache holds the ones it has just verified.
        return Metadata[Any].from_bytes((self._folder / f"{quote(role, '')}.json").read_bytes()).signed


def choose(offered: Versions, name: str, version: str | None = None, robot: str | None = None) -> Release:
    """Return the release asked for; without a version the newest one, pre-releases only when nothing else is there.

    :param robot: this robot's name: what is only for others is left out
    :raises Refused: when the store has no such package
    :raises Untrusted: when all there is, is for other robots
    """
    found = [item for item in offered.releases if version in (None, item.version.text)]
    if not found:
        raise Refused(f"cannot find {name} {version or ''}".rstrip() + " in the store: ask for the list of RApps")
    fitting = [item for item in found if robot is None or robot in (item.robots or (robot,))]
    if not fitting:
        raise untrusted(Attack.OTHER_ROBOT, f"{name} is for {', '.join(found[-1].robots)}, this is {robot}")
    return max(fitting, key=lambda item: ("-" not in item.version.text, item.version.key))


def _release(path: str, target: TargetFile) -> Release | None:
    custom = target.custom or {}
    try:
        name, version = check_name(str(custom.get("name"))), parse_version(str(custom.get("version")))
    except Invalid:
        return None
    if path != package_file_name(name, version.text):
        return None
    robots = custom.get("robots", [])
    if not isinstance(robots, list):
        return None
    return Release(name, version, target.length, target, tuple(str(robot) for robot in robots))


def _yanked(targets: Targets, name: str) -> set[str]:
    paths = targets.unrecognized_fields.get(YANKED, {})
    return {path[len(name) + 1 : -3] for path in paths if path.startswith(f"{name}-")} if isinstance(paths, dict) else set()


class _Fetcher(FetcherInterface):
    """`tuf`'s port on top of ours: the limit is known before the first byte is asked for."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._on_progress: Progress | None = None
        self._destination: Path | None = None

    @contextmanager
    def watched(self, on_progress: Progress | None, destination: Path) -> Iterator[None]:
        self._on_progress, self._destination = on_progress, destination
        try:
            yield
        finally:
            self._on_progress = self._destination = None

    def _fetch(self, url: str) -> Iterator[bytes]:
        raise tuf.DownloadError(f"cannot fetch {url} without a limit")

    @contextmanager
    def download_file(self, url: str, max_length: int) -> Iterator[IO[bytes]]:
        on_progress, destination = (None, None) if "/metadata/" in url else (self._on_progress, self._destination)
        with partial(destination, max_length) as file:
            start = file.seek(0, os.SEEK_END)
            try:
                if start < max_length:
                    self._transport.get(url, file.write, max_length, on_progress, start)
            except (Refused, Bug) as error:
                raise tuf.DownloadHTTPError(str(error), error.status or 403) from None
            except Invalid as error:
                raise tuf.DownloadLengthMismatchError(str(error)) from None
            except Unreachable as error:
                raise Away(error) from None
            file.seek(0)
            yield file
