"""The package files of a store, and an index of what they say of themselves, so that not every process opens them all.

The index is a cache: a line per package, only ever added to. A line counts while the file's size and time are
those of when it was read and verified; robots verify what they get in any case. Blocking.
"""

import logging
import os
import zlib
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, BinaryIO

import orjson
from tuf.api.exceptions import RepositoryError
from tuf.api.metadata import TargetFile  # type: ignore[attr-defined]  # public, but not in __all__

from rapp_cloud.files import write_whole
from rapp_hop.errors import Bug, Invalid
from rapp_hop.hz.archive import Contents, inspect
from rapp_hop.hz.manifest import Manifest, Needs, Permissions
from rapp_hop.hz.semver import parse_version
from rapp_hop.hz.tar import Limits

_SPARE = 1000  # lines that count no more, beside as many as count, until the index is written anew
_log = logging.getLogger(__name__)

_FIELDS = tuple(f"{kind.__name__}.{field.name}" for kind in (Manifest, Permissions, Needs) for field in fields(kind))
_FORMAT = zlib.crc32(" ".join(_FIELDS).encode())  # of a line: another one was written by another version of the platform

_Line = tuple[int, int, Any]  # size in bytes, time of the last change in ns, the manifest's fields


class PackageFiles:
    """The packages in one folder."""

    def __init__(self, folder: Path, index: Path, limits: Limits) -> None:
        """Remember the places; reads nothing yet."""
        self._folder = folder
        self._path = index
        self._limits = limits
        self._manifests: dict[str, Manifest] = {}  # by hash and path: a package never changes
        self._lines: dict[str, _Line] | None = None
        self._new: dict[str, _Line] = {}

    def manifest(self, target: TargetFile) -> Manifest:
        """Return what a package says of itself.

        :raises Bug: when it is gone or was changed behind our back
        """
        name = _name(target)
        if name not in self._manifests:
            self._manifests[name] = self._indexed(target, name) or self._inspected(target, name)
        return self._manifests[name]

    def read(self, target: TargetFile, read: Callable[[BinaryIO], Contents]) -> Contents:
        """Hand over a package whose length and hash are right. Raises as `manifest`."""
        try:
            with (self._folder / _name(target)).open("rb") as file:
                target.verify_length_and_hashes(file)
                file.seek(0)
                return read(file)
        except (OSError, RepositoryError, Invalid) as error:
            raise Bug(f"cannot read {target.path} on the shelf: {error}, restore it from a backup") from None

    def keep(self) -> None:
        """Write what was read since the last time into the index; where the disk is unwilling it is read again by the next."""
        if not self._new:
            return
        lines, self._new = self._new, {}
        # A line end first: what a cut-off writer has left must not spoil the next line.
        data = b"\n" + _written(lines)
        if not data.strip():
            return
        try:
            self._path.parent.mkdir(mode=0o700, exist_ok=True)
            handle = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
            with os.fdopen(handle, "wb", buffering=0) as file:
                file.write(data)
        except OSError as error:
            _log.warning("%s cannot be written (%s): packages are read again at the next start", self._path, error.strerror)

    def _indexed(self, target: TargetFile, name: str) -> Manifest | None:
        if self._lines is None:
            self._lines = self._load()
        line = self._lines.get(name)
        if line is None or line[:2] != self._state(name) or line[0] != target.length:
            return None
        return _manifest_of(line[2])

    def _inspected(self, target: TargetFile, name: str) -> Manifest:
        state = self._state(name)
        manifest = self.read(target, lambda file: inspect(file, self._limits)).manifest
        if state is not None:
            self._new[name] = (*state, manifest)
        return manifest

    def _state(self, name: str) -> tuple[int, int] | None:
        try:
            status = (self._folder / name).stat()
        except OSError:
            return None
        return status.st_size, status.st_mtime_ns

    def _load(self) -> dict[str, _Line]:
        try:
            data = self._path.read_bytes()
        except OSError:
            return {}
        found: dict[str, _Line] = {}
        count = 0
        for line in data.splitlines():
            count += bool(line)
            try:
                version, name, size, time, manifest = orjson.loads(line)
            except (ValueError, TypeError):
                continue
            if version == _FORMAT:
                found[str(name)] = (size, time, manifest)
        if count > 2 * len(found) + _SPARE:
            self._write_anew(found)
        return found

    def _write_anew(self, lines: dict[str, _Line]) -> None:
        try:
            write_whole(self._path, _written(lines), mode=0o600)
        except OSError as error:
            _log.warning("%s cannot be written: %s", self._path, error.strerror)


def _name(target: Any) -> str:
    return f"{target.hashes['sha256']}.{target.path}"


def _written(lines: Mapping[str, _Line]) -> bytes:
    """Return lines as they stand in the index; what cannot be written there is read from its package each time."""
    pieces = []
    for name, line in lines.items():
        try:
            pieces.append(orjson.dumps([_FORMAT, name, *line]) + b"\n")
        except TypeError as error:  # an integer of more than 64 bits, which packages might have before they were checked for it
            _log.warning("%s is left out of the index: %s", name, error)
    return b"".join(pieces)


def _manifest_of(found: Any) -> Manifest | None:
    """Return a manifest that was checked before it went into the index; None: it is of another version of the platform."""
    try:
        return Manifest(**{
            **found,
            "version": parse_version(found["version"]["text"]),
            "keywords": _tuples(found["keywords"]),
            "sentences": _tuples(found["sentences"]),
            "permissions": Permissions(**_tuples(found["permissions"])),
            "needs": Needs(tuple(found["needs"]["robot"]), found["needs"]["api"]),
        })  # fmt: skip
    except (AttributeError, KeyError, TypeError, Invalid):
        return None


def _tuples(lists: dict[str, list[str]]) -> dict[str, tuple[str, ...]]:
    return {name: tuple(texts) for name, texts in lists.items()}
