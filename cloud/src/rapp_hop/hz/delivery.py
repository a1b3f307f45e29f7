"""From the store onto the robot: list, download, verify, install; asynchronous, for who lives in an asyncio loop.

The verifying half (`trust`) and the disk half (`install`) block, so they run in a thread, and ask the loop's client for
bytes. Different RApps are installed side by side; who asks for one that is being installed waits for it.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Refused
from rapp_hop.hz.archive import inspect
from rapp_hop.hz.downloads import Downloads
from rapp_hop.hz.install import Installed, PackageFile, RappFolder, install
from rapp_hop.hz.manifest import Manifest, reasons_against
from rapp_hop.hz.quota import Claim, Quota, running, unpacked_size
from rapp_hop.hz.semver import parse_version
from rapp_hop.hz.transport import DeliveryLimits, LoopTransport, in_thread
from rapp_hop.hz.trust import Attack, Release, TrustedStore, Untrusted, Versions, choose

__all__ = ["Delivery", "DeliveryLimits", "OnPhase", "Recipient"]

OnPhase = Callable[[str, dict[str, Any]], None]  # "downloading" | "verified" | "installed", and details
_Tell = Callable[..., None]
AT_ONCE = 3  # installations
_log = logging.getLogger(__name__)


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
        self._downloads = Downloads(home / "downloads")
        self._quota = Quota(self._limits.quota, home, self.folder, self._downloads)
        self._places = asyncio.Semaphore(AT_ONCE)
        self._busy: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()  # by RApp

    async def install(
        self, name: str, version: str | None = None, on_phase: OnPhase | None = None, robot: Recipient | None = None
    ) -> Installed:
        """Install a RApp, the newest version when none is named; one that is there already is not fetched again.

        The newest version is not taken again when it is the one that was gone back from. A download that breaks off is
        gone on with by the next one. Cancelling ends the download and waits for the thread, so that nothing half done goes on.

        :param on_phase: called in this loop
        :param robot: what cannot run there, or is not for it, is refused
        :raises Untrusted: the store cannot be believed (`.attack` says why)
        :raises Invalid: the package is not right
        :raises Refused: no such RApp, not for this robot, or the disk is unwilling
        :raises Unreachable: try again later; `reason` says when it came too slowly
        """
        loop = asyncio.get_running_loop()
        transport = LoopTransport(self._client, loop, self._limits)

        def tell(phase: str, **details: Any) -> None:
            if on_phase is not None:
                loop.call_soon_threadsafe(on_phase, phase, details)

        async with self._alone(name), self._places:
            return await in_thread(transport, self._install, transport, _Wish(name, version, robot), tell)

    async def drop_revoked(self) -> frozenset[str]:
        """Remove the RApps that are signed by revoked keys only; return their names, also of those the disk would not let go.

        One that runs goes too: its run has a copy. One of which another version has come meanwhile is left to the next look.

        :raises HopError: when the store cannot be believed or reached; nothing was removed then
        :raises OSError: when the disk refuses what is to be noted of the store
        """
        here = await asyncio.to_thread(self._versions)
        if not here:
            return frozenset()
        transport, gone = LoopTransport(self._client, asyncio.get_running_loop(), self._limits), set()
        for name in await in_thread(transport, self._revoked, transport, here):
            async with self._alone(name):
                if await asyncio.to_thread(self.folder.versions, name) == here[name]:
                    await asyncio.to_thread(self._drop, name)
                    gone.add(name)
        return frozenset(gone)

    async def remove(self, name: str) -> bool:
        """Remove a RApp and what has come of its next version; false when it was not there.

        :raises Refused: while it runs, or when the disk is unwilling
        """
        async with self._alone(name):
            return await asyncio.to_thread(self._remove, name)

    async def started(self, name: str, version: str, ok: bool) -> Installed | None:
        """Take note how the first start of a version ended: one that started replaces the version before for good.

        :return: the version before, when it is the current one again
        :raises Refused: when the disk is unwilling
        """
        async with self._alone(name):
            return await asyncio.to_thread(self._started, name, version, ok)

    async def tidy(self) -> None:
        """Remove what an interrupted installation has left; to be called before the first one.

        :raises Refused: when the disk is unwilling
        """
        await asyncio.to_thread(self._tidy)

    async def installed(self) -> dict[str, Manifest]:
        """Return the manifests of the installed RApps by name."""
        return await asyncio.to_thread(self.folder.list)

    def _alone(self, name: str) -> asyncio.Lock:
        return self._busy.setdefault(name, asyncio.Lock())

    def _started(self, name: str, version: str, ok: bool) -> Installed | None:
        if ok:
            self.folder.settle(name, version)
            return None
        there = self.folder.find(name)
        return self.folder.go_back(name) if there is not None and there.version == version else None

    def _remove(self, name: str) -> bool:
        if name in running(self._home / "runs"):
            raise Refused(f"cannot remove {name}: it runs, stop it or wait for its end")
        removed = self.folder.remove(name)
        try:
            self._downloads.remove(name)
        except OSError as error:
            raise Refused(f"cannot remove what has come of {name}: {error.strerror}, check the disk") from None
        return removed

    def _tidy(self) -> None:
        self.folder.tidy()
        try:
            self._downloads.tidy(self.folder.find)
        except OSError as error:
            raise Refused(f"cannot tidy up downloads: {error.strerror}, check the disk") from None

    def _store(self, transport: LoopTransport) -> TrustedStore:
        return TrustedStore(transport, f"{self._client.base_url}/tuf", self._root, self._home / "trust", self._limits.package)

    def _versions(self) -> dict[str, tuple[str, ...]]:
        return {name: self.folder.versions(name) for name in self.folder.names()}

    def _revoked(self, transport: LoopTransport, here: Mapping[str, tuple[str, ...]]) -> frozenset[str]:
        return self._store(transport).revoked(here)

    def _drop(self, name: str) -> None:
        try:
            if self.folder.remove(name):
                _log.warning("%s has gone, its publisher's key was revoked", name)
        except HopError as error:
            _log.error("%s", error)

    def _install(self, transport: LoopTransport, wish: "_Wish", tell: _Tell) -> Installed:
        store = self._store(transport)
        try:
            offered = store.versions(wish.name)
            if offered.revoked:
                self._drop(wish.name)
                raise Untrusted(Attack.REVOKED, f"cannot install {wish.name}: its publisher's key was revoked, take another RApp")
            release = choose(offered, wish.name, wish.version, wish.robot.name if wish.robot else None)
            present = self._present(release, wish, offered)
            if present is not None:
                self.folder.use(present)
                return present
            if wish.version is None:
                self._check_not_older(release, offered)
            with self._quota.claim(wish.name) as claim:
                return self._fetch(store, release, wish, tell, claim)
        except OSError as error:
            raise Refused(f"cannot install {wish.name}: {error.strerror}, check the disk") from None

    def _present(self, release: Release, wish: "_Wish", offered: Versions) -> Installed | None:
        """Return what is installed when nothing better is on offer: the newest, or the one before a version that failed.

        What a restored store does not know any more was verified when it came, and stays until a newer one is on offer.
        """
        there = self.folder.find(wish.name)
        if there is not None and wish.version is None and offered.restored and _is_lost(there.version, release, offered):
            return there
        failed = self.folder.failed(wish.name) if wish.version is None else None
        return there if there is not None and release.version.text in (there.version, failed) else None

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

    def _fetch(self, store: TrustedStore, release: Release, wish: "_Wish", tell: _Tell, claim: Claim) -> Installed:
        name, version, length = release.name, release.version.text, release.length
        package = self._downloads.file(name, version, "".join(release.target.hashes.values()))
        claim(length)
        tell("downloading", version=version, bytes=0, of=length)
        store.download(release, package, lambda count, _: tell("downloading", bytes=count, of=length))
        tell("verified", version=version)
        try:
            if self._quota.limit:
                with package.open("rb") as file:
                    claim(length + unpacked_size(inspect(file, self._limits.package)))
            done = install(PackageFile(package, name, version, self._limits.package, wish.check), self.folder)
        finally:
            package.unlink(missing_ok=True)
        tell("installed", version=done.version, path=str(done.path))
        return done


def _is_lost(version: str, newest: Release, offered: Versions) -> bool:
    """Whether a version is newer than all on offer, and the store does not know it."""
    known = {*offered.yanked, *(release.version.text for release in offered.releases)}
    return version not in known and parse_version(version).key > newest.version.key


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
