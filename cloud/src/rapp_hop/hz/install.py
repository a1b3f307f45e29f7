"""Installed RApps on a disk: `install(source, destination)`, its undo `remove`, and the way back to the version before.

Layout: `<root>/<name>/<version>/` and links beside it: `current`; `previous`, the last version that has started, there
only until `current` has started too (DESIGN §3.4); `failed`, a version that did not. A version appears whole or not at
all: unpacked aside, brought to the disk, renamed; then `current` is switched by renaming a link over it. Power loss
leaves what was; what else it leaves goes with the next call. When a RApp was used last is its folder's time.
"""

import contextlib
import errno
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from rapp_hop.errors import HopError, Invalid, Refused
from rapp_hop.hz.archive import MANIFEST, extract, sync_folder
from rapp_hop.hz.lock import held
from rapp_hop.hz.manifest import Manifest, parse_manifest
from rapp_hop.hz.semver import parse_version
from rapp_hop.hz.tar import Limits
from rapp_hop.hz.text import NAME, check_name

CURRENT, PREVIOUS, FAILED = "current", "previous", "failed"
_ASIDE = ".aside-"  # begin of every name that is not finished or not wanted any more


class Source(Protocol):
    """A package about to be installed: who it must be, and how it comes onto a disk."""

    @property
    def name(self) -> str:
        """Name that the manifest must have."""

    @property
    def version(self) -> str:
        """Version that the manifest must have."""

    def unpack(self, folder: Path) -> Manifest:
        """Fill the new folder and return the manifest found; all of it is on the disk afterwards."""


@dataclass(frozen=True)
class PackageFile:
    """The source for a verified .hz file."""

    path: Path
    name: str
    version: str
    limits: Limits
    check: Callable[[Manifest], None] = lambda _manifest: None  # raises what stands against it

    def unpack(self, folder: Path) -> Manifest:
        """Fill the new folder from the file; see `archive.extract`."""
        with self.path.open("rb") as file:
            manifest = extract(file, folder, self.limits).manifest
        self.check(manifest)
        return manifest


@dataclass(frozen=True)
class Installed:
    """A version of a RApp on the disk."""

    name: str
    version: str
    path: Path  # absolute
    new: bool = False  # true when this call brought it


class RappFolder:
    """The destination: all installed RApps under one folder. Blocking; safe between threads and processes."""

    def __init__(self, root: Path) -> None:
        self.root = root.absolute()

    def find(self, name: str, version: str | None = None) -> Installed | None:
        """Return the installed version (the current one when none is named), or None."""
        check_name(name)
        if version is None:
            version = self._linked(name, CURRENT)
        if version is None or not (self.root / name / version / MANIFEST).is_file():
            return None
        return Installed(name, version, self.root / name / version)

    def list(self) -> dict[str, Manifest]:
        """Return the manifest of the current version of each installed RApp; a damaged one is left out."""
        found: dict[str, Manifest] = {}
        for name in self.names():
            try:
                installed = self.find(name)
                if installed is not None:
                    found[name] = parse_manifest((installed.path / MANIFEST).read_bytes())
            except (HopError, OSError):
                continue
        return found

    def names(self) -> tuple[str, ...]:
        """Return the names of all RApps of which something is here."""
        found = self.root.iterdir() if self.root.is_dir() else iter(())
        return tuple(sorted(path.name for path in found if NAME.fullmatch(path.name) and path.is_dir()))

    def versions(self, name: str) -> tuple[str, ...]:
        """Return the versions of a RApp that may be started: the current one, and the one before while it is here."""
        linked = (self._linked(check_name(name), link) for link in (CURRENT, PREVIOUS))
        return tuple(version for version in linked if version is not None)

    def last_used(self, name: str) -> float:
        """Return when a RApp was installed or used last, in s since 1970; 0 when it is not there."""
        installed = self.find(name)
        try:
            return installed.path.stat().st_mtime if installed else 0.0
        except FileNotFoundError:
            return 0.0

    def failed(self, name: str) -> str | None:
        """Return the version that was gone back from, if any."""
        return self._linked(check_name(name), FAILED)

    def use(self, installed: Installed) -> None:
        """Note that a RApp is used now; a disk that cannot be written to notes nothing."""
        with contextlib.suppress(OSError):
            os.utime(installed.path)

    def tidy(self) -> None:
        """Remove what an interrupted call has left, or finish it.

        :raises Refused: when the disk is unwilling
        """
        with self._locked():
            pass

    def place(self, source: Source) -> Installed:
        """Put the source's version beside the others and make it the current one.

        :raises Invalid: when the package is not right or not the one that was asked for
        :raises Refused: when the disk is full, read-only or otherwise unwilling
        :raises Unreachable: when another installation holds the folder too long
        """
        name, version = check_name(source.name), parse_version(source.version).text
        with self._locked():
            there = self.find(name, version)
            if there is None:
                self._unpack(source, name, version)
            self._switch(name, version)
        return Installed(name, version, self.root / name / version, new=there is None)

    def remove(self, name: str) -> bool:
        """Take all versions of a RApp away; false when there was none."""
        with self._locked():
            if not (self.root / check_name(name)).is_dir():
                return False
            self._throw_away(self.root / name)
            return True

    def settle(self, name: str, version: str) -> bool:
        """A version has started: the one before is needed no more. False when there is nothing to settle."""
        with self._locked():
            if self._linked(check_name(name), CURRENT) != version or self._linked(name, PREVIOUS) is None:
                return False
            (self.root / name / PREVIOUS).unlink()
            sync_folder(self.root / name)
            self._prune(name)
            return True

    def go_back(self, name: str) -> Installed:
        """Make the version before the current one again, throw the failed one away and remember it.

        :raises Refused: when there is no version before
        """
        with self._locked():
            failed, before = self._linked(check_name(name), CURRENT), self._linked(name, PREVIOUS)
            if before is None or failed is None or self.find(name, before) is None:
                raise Refused(f"cannot go back with {name}: there is no version before, install it again")
            _link(self.root / name, FAILED, failed)
            self._mend(name)
        return Installed(name, before, self.root / name / before)

    def _unpack(self, source: Source, name: str, version: str) -> None:
        aside = self.root / f"{_ASIDE}{secrets.token_hex(8)}"
        try:
            manifest = source.unpack(aside)
            if (manifest.name, manifest.version.text) != (name, version):
                raise Invalid(f"cannot install {name} {version}: the package says it is {manifest.name} {manifest.version}")
            if manifest.agent == "cloud":
                raise Refused(f"cannot install {name}: it is a cloud agent, which the platform runs; install its RApp")
            aside.chmod(0o755)
            (self.root / name).mkdir(exist_ok=True)
            aside.rename(self.root / name / version)
            sync_folder(self.root / name)
            sync_folder(self.root)
        except BaseException:
            shutil.rmtree(aside, ignore_errors=True)
            raise

    def _switch(self, name: str, version: str) -> None:
        folder, was = self.root / name, self.find(name)
        if self._linked(name, FAILED) == version:
            (folder / FAILED).unlink()
        if was is not None and was.version == version:
            return
        if was is not None and self._linked(name, PREVIOUS) is None:
            _link(folder, PREVIOUS, was.version)  # else `was` has never started, and the one before is the one to keep
        _link(folder, CURRENT, version)
        sync_folder(folder)
        self._mend(name)

    def _mend(self, name: str) -> None:
        """Finish what was begun with a RApp's links, and remove what they do not lead to."""
        folder, failed = self.root / name, self._linked(name, FAILED)
        current, before = self._linked(name, CURRENT), self._linked(name, PREVIOUS)
        if current is not None and current == failed and before is not None and self.find(name, before) is not None:
            _link(folder, CURRENT, before)
            current = before
        if before is not None and before == current:
            (folder / PREVIOUS).unlink()
            sync_folder(folder)
        self._prune(name)
        if current is None:
            with contextlib.suppress(OSError):
                folder.rmdir()  # only when nothing is in it

    def _prune(self, name: str) -> None:
        kept = {self._linked(name, CURRENT), self._linked(name, PREVIOUS)}
        for path in (self.root / name).iterdir():
            if path.is_dir() and not path.is_symlink() and path.name not in kept:
                self._throw_away(path)

    def _throw_away(self, folder: Path) -> None:
        aside = self.root / f"{_ASIDE}{secrets.token_hex(8)}"
        folder.rename(aside)
        sync_folder(folder.parent)
        shutil.rmtree(aside, ignore_errors=True)

    def _linked(self, name: str, link: str) -> str | None:
        try:
            return parse_version((self.root / name / link).readlink().name).text
        except (OSError, Invalid):
            return None

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Hold the folder alone, sweep up what an interrupted call left, and translate the disk's errors."""
        try:
            self.root.mkdir(parents=True, exist_ok=True)
            with held(self.root / ".lock", "install"):
                for path in self.root.glob(f"{_ASIDE}*"):
                    shutil.rmtree(path, ignore_errors=True)
                for link in self.root.glob(f"*/{_ASIDE}*"):
                    link.unlink()
                for name in self.names():
                    self._mend(name)
                yield
        except OSError as error:
            step = "free some space" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "check the folder"
            raise Refused(f"cannot change {self.root}: {error.strerror}, {step}") from None


def install(source: Source, destination: RappFolder) -> Installed:
    """Install a package: unpack aside, check who it is, rename, switch. See `RappFolder.place` for the errors."""
    return destination.place(source)


def _link(folder: Path, name: str, target: str) -> None:
    aside = folder / f"{_ASIDE}{secrets.token_hex(8)}"
    aside.symlink_to(target)
    aside.replace(folder / name)
