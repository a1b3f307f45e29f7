"""From the store onto the robot: list, download, verify, install; asynchronous, for who lives in an asyncio loop.

The verifying half (`trust`) and the disk half (`install`) block, so they run in a thread, and ask the loop's client for
bytes.
"""

import asyncio
import concurrent.futures
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rapp_hop.client import HopClient
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.hz.install import Installed, PackageFile, RappFolder, install
from rapp_hop.hz.manifest import Manifest, reasons_against
from rapp_hop.hz.semver import parse_version
from rapp_hop.hz.tar import Limits
from rapp_hop.hz.trust import Attack, Release, TrustedStore, Untrusted, Versions, choose
from rapp_hop.streaming import Progress, Writer

OnPhase = Callable[[str, dict[str, Any]], None]  # "downloading" | "verified" | "installed", and details
_Tell = Callable[..., None]


@dataclass(frozen=True)
class DeliveryLimits:
    """Bounds of a delivery."""

    metadata_timeout: float = 10.0  # seconds per metadata file
    package_timeout: float = 120.0  # seconds per package
    slowest: float = 1024.0  # bytes per second on average over each `window`; less is slow retrieval
    window: float = 5.0  # seconds
    package: Limits = field(default_factory=Limits)


@dataclass(frozen=True)
class Recipient:
    """The robot that a package is for."""

    name: str
    kind: str
    api_version: str  # of its core agent


class Delivery:
    """Brings RApps from one store into one folder."""

    def __init__(self, client: HopClient, root: bytes, home: Path, limits: DeliveryLimits | None = None) -> None:
        """Prepare; touches neither disk nor network.

        :param client: of the platform whose store it is (`<base_url>/tuf`)
        :param root: the trusted root.json that came with the robot
        :param home: the robot's data folder: packages go to `rapps/`, what was seen of the store to `trust/`
        """
        self._client = client
        self._root = root
        self._home = home
        self._limits = limits or DeliveryLimits()
        self.folder = RappFolder(home / "rapps")
        self._one = asyncio.Lock()  # what was seen of the store has one writer

    async def install(
        self, name: str, version: str | None = None, on_phase: OnPhase | None = None, robot: Recipient | None = None
    ) -> Installed:
        """Install a RApp, the newest version when none is named; one that is there already is not fetched again.

        Cancelling ends the download and waits for the thread, so that nothing half done goes on.

        :param on_phase: called in this loop
        :param robot: what cannot run there, or is not for it, is refused
        :raises Untrusted: the store cannot be believed (`.attack` says why)
        :raises Invalid: the package is not right
        :raises Refused: no such RApp, not for this robot, or the disk is unwilling
        :raises Unreachable: try again later; `reason` says when it came too slowly
        """
        loop = asyncio.get_running_loop()
        transport = _LoopTransport(self._client, loop, self._limits)

        def tell(phase: str, **details: Any) -> None:
            if on_phase is not None:
                loop.call_soon_threadsafe(on_phase, phase, details)

        async with self._one:
            work = asyncio.ensure_future(asyncio.to_thread(self._install, transport, _Wish(name, version, robot), tell))
            try:
                return await asyncio.shield(work)
            except asyncio.CancelledError:
                transport.cancel()
                await asyncio.wait([work])
                work.exception()  # taken: the caller asked for the end, not for its reason
                raise

    async def remove(self, name: str) -> bool:
        """Remove a RApp; false when it was not there."""
        return await asyncio.to_thread(self.folder.remove, name)

    async def installed(self) -> dict[str, Manifest]:
        """Return the manifests of the installed RApps by name."""
        return await asyncio.to_thread(self.folder.list)

    def _install(self, transport: "_LoopTransport", wish: "_Wish", tell: _Tell) -> Installed:
        store = TrustedStore(transport, f"{self._client.base_url}/tuf", self._root, self._home / "trust", self._limits.package)
        try:
            offered = store.versions(wish.name)
            release = choose(offered, wish.name, wish.version, wish.robot.name if wish.robot else None)
            present = self.folder.find(wish.name, release.version.text)
            if present is not None and self.folder.find(wish.name) == present:
                return present
            if wish.version is None:
                self._check_not_older(release, offered)
            aside = self._new_file()
            try:
                return self._fetch(store, release, aside, wish, tell)
            finally:
                aside.unlink(missing_ok=True)
        except OSError as error:
            raise Refused(f"cannot install {wish.name}: {error.strerror}, check the disk") from None

    def _check_not_older(self, release: Release, offered: Versions) -> None:
        """Refuse to go back behind what is installed, unless its publisher took that off offer.

        A version that was mended must not come back by itself.
        """
        there = self.folder.find(release.name)
        if there is None or there.version in offered.yanked:
            return
        if release.version.key < parse_version(there.version).key:
            older = f"cannot install {release.name} {release.version.text}: {there.version} is installed"
            raise Untrusted(Attack.ROLLBACK, f"{older}; remove it first if the older one is wanted")

    def _fetch(self, store: TrustedStore, release: Release, aside: Path, wish: "_Wish", tell: _Tell) -> Installed:
        name, version = release.name, release.version.text
        tell("downloading", version=version, bytes=0, of=release.length)
        store.download(release, aside, lambda count, _: tell("downloading", bytes=count, of=release.length))
        tell("verified", version=version)
        done = install(PackageFile(aside, name, version, self._limits.package, wish.check), self.folder)
        tell("installed", version=done.version, path=str(done.path))
        return done

    def _new_file(self) -> Path:
        """Return the name of a file to download to; files that a power cut left behind go."""
        folder = self._home / "downloads"
        folder.mkdir(parents=True, exist_ok=True)
        too_old = time.time() - 2 * self._limits.package_timeout
        for path in folder.glob("*.hz"):
            if path.stat().st_mtime < too_old:
                path.unlink(missing_ok=True)
        return folder / f"{secrets.token_hex(8)}.hz"


@dataclass(frozen=True)
class _Wish:
    """What is to be installed, and for whom."""

    name: str
    version: str | None
    robot: Recipient | None

    def check(self, manifest: Manifest) -> None:
        """Refuse what this robot cannot run (P30)."""
        reasons = reasons_against(manifest, self.robot.kind, self.robot.api_version) if self.robot else []
        if reasons:
            raise Refused(f"cannot install {self.name}: {'; '.join(reasons)}")


class _LoopTransport:
    """Bytes for a thread, fetched by the client of a loop."""

    def __init__(self, client: HopClient, loop: asyncio.AbstractEventLoop, limits: DeliveryLimits) -> None:
        self._client = client
        self._loop = loop
        self._limits = limits
        self._lock = threading.Lock()
        self._running: concurrent.futures.Future[int] | None = None
        self._cancelled = False

    def get(self, url: str, write: Writer, limit: int, on_progress: Progress | None) -> None:
        """Fetch `url`; see `trust.Transport`."""
        timeout = self._limits.metadata_timeout if "/metadata/" in url else self._limits.package_timeout
        with self._lock:
            if self._cancelled:
                raise Unreachable(f"cannot fetch {url}: it was given up")
            work = self._watched(url, write, limit, timeout, on_progress)
            self._running = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            self._running.result(timeout + 5)
        except concurrent.futures.CancelledError:
            raise Unreachable(f"cannot fetch {url}: it was given up") from None
        except TimeoutError:
            self._running.cancel()
            raise Unreachable(f"cannot fetch {url} within {timeout:g} s: try again later") from None

    async def _watched(self, url: str, write: Writer, limit: int, timeout: float, on_progress: Progress | None) -> int:
        """Fetch, and give up a line that is kept open by a trickle (Uptane's slow retrieval)."""
        count = before = 0

        def counted(piece: bytes) -> object:
            nonlocal count
            count += len(piece)
            return write(piece)

        work = asyncio.ensure_future(self._client.download(url, counted, limit, timeout, on_progress))
        try:
            while not (await asyncio.wait([work], timeout=self._limits.window))[0]:
                if 0 < count < before + self._limits.slowest * self._limits.window:
                    slow = Unreachable(f"cannot fetch {url}: {Attack.SLOW}, {count} bytes so far, try again later")
                    slow.reason = Attack.SLOW.value
                    raise slow
                before = count
            return work.result()
        finally:
            work.cancel()
            await asyncio.wait([work])

    def cancel(self) -> None:
        """End the fetch under way and refuse the next ones."""
        with self._lock:
            self._cancelled = True
            if self._running is not None:
                self._running.cancel()
