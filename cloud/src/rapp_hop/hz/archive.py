"""HZ archives: `build` a folder into the same bytes every time, `inspect` one, `extract` one into a new folder.

`<name>-<version>.hz` is a gzipped tar with one top folder `<name>/` that holds `package.json` (DESIGN §3.4). The same
input gives the same bytes wherever the same zlib is used: order, times, owners, modes and the gzip header are fixed.
`etc/weblet.info`, for Hop's own package manager, is made from the manifest, whatever a source has there.
"""

import io
import os
import shutil
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.manifest import MAX_BYTES, Manifest, check_numbers, parse_manifest
from rapp_hop.hz.tar import BLOCK, Limits, Member, TarReader, checked_path
from rapp_hop.hz.weblet import WEBLET_INFO, weblet_info

MANIFEST = "package.json"
_IGNORED = ("__pycache__",)
_FOLDER, _PLAIN, _PROGRAM = 0o755, 0o644, 0o755  # the only modes that are packed or unpacked


@dataclass(frozen=True)
class Contents:
    """What a package holds: its manifest and its members."""

    manifest: Manifest
    members: tuple[Member, ...]

    @property
    def for_hop(self) -> bool:
        """Whether Hop's own package manager can read what it is (`etc/weblet.info`)."""
        return any(member.path[1:] == WEBLET_INFO and not member.folder for member in self.members)


def package_file_name(name: str, version: str) -> str:
    """Return the name of a package's file."""
    return f"{name}-{version}.hz"


def build(folder: Path, limits: Limits | None = None) -> bytes:
    """Return the package made of a folder with a package.json; left out are `__pycache__` and names with a dot first.

    :raises Invalid: when the manifest is wrong, a link or device is inside, or a limit is passed
    :raises Refused: when the folder cannot be read
    """
    limits = limits or Limits()
    try:
        manifest = parse_manifest((folder / MANIFEST).read_bytes())
        check_numbers(manifest)
        packer = zlib.compressobj(9, zlib.DEFLATED, 31)
        pieces = [packer.compress(piece) for piece in _tar(folder, manifest, limits)]
    except OSError as error:
        raise Refused(f"cannot build a package of {folder}: {error.strerror}: {error.filename}") from None
    packed = b"".join([*pieces, packer.flush()])
    inspect(io.BytesIO(packed), limits)  # what the robot will refuse must not leave the workshop
    return packed


def inspect(source: BinaryIO, limits: Limits | None = None) -> Contents:
    """Read a package through, writing nothing.

    :raises Invalid: when it is not a right package
    """
    return _read(source, limits or Limits(), None)


def extract(source: BinaryIO, destination: Path, limits: Limits | None = None) -> Contents:
    """Unpack a package into the new folder `destination` (the package's own top folder is not repeated there).

    Every file and folder is on the disk (fsync) when this returns. After an error nothing is left.

    :raises Invalid: when it is not a right package
    :raises OSError: when the disk is full or read-only, or the folder is there already
    """
    destination.mkdir(mode=0o700)
    try:
        return _read(source, limits or Limits(), destination)
    except BaseException:
        shutil.rmtree(destination, ignore_errors=True)
        raise


def _read(source: BinaryIO, limits: Limits, destination: Path | None) -> Contents:
    reader = TarReader(source, limits)
    seen: list[Member] = []
    manifest_bytes: bytes | None = None
    for member in reader.members():
        if member.path[0] != (seen[0].path[0] if seen else member.path[0]):
            raise Invalid("cannot unpack: it has more than one top folder")
        if len(member.path) == 1 and not member.folder:
            raise Invalid("cannot unpack: a file stands outside the top folder")
        seen.append(member)
        pieces: Iterable[bytes] = reader.data()
        if member.path[1:] == (MANIFEST,) and not member.folder:
            if member.size > MAX_BYTES:
                raise Invalid(f"cannot unpack: {MANIFEST} is larger than {MAX_BYTES} bytes")
            manifest_bytes = b"".join(pieces)
            pieces = [manifest_bytes]
        if destination is not None:
            _write(destination, member, pieces)
    contents = _contents(seen, manifest_bytes)
    if destination is not None:
        _sync_folders(destination)
    return contents


def _contents(seen: list[Member], manifest_bytes: bytes | None) -> Contents:
    if not seen:
        raise Invalid("cannot unpack: it is empty")
    if manifest_bytes is None:
        raise Invalid(f"cannot unpack: it has no {seen[0].path[0]}/{MANIFEST}")
    manifest = parse_manifest(manifest_bytes)
    if manifest.name != seen[0].path[0]:
        raise Invalid(f"cannot unpack: the top folder is {seen[0].path[0]!r}, the manifest says {manifest.name!r}")
    if not any(not member.folder and "/".join(member.path[1:]) == manifest.entry for member in seen):
        raise Invalid(f"cannot unpack: the entry {manifest.entry!r} is not a file of the package")
    return Contents(manifest, tuple(seen))


def _write(destination: Path, member: Member, pieces: Iterable[bytes]) -> None:
    place = destination.joinpath(*member.path[1:])
    if member.folder:
        place.mkdir(mode=_FOLDER, parents=True, exist_ok=True)
        return
    place.parent.mkdir(mode=_FOLDER, parents=True, exist_ok=True)
    mode = _PROGRAM if member.executable else _PLAIN
    # The folder is new and ours and holds no link; O_EXCL and O_NOFOLLOW keep it so.
    handle = os.open(place, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, mode)
    with os.fdopen(handle, "wb") as file:
        for piece in pieces:
            file.write(piece)
        file.flush()
        os.fsync(file.fileno())


def _sync_folders(top: Path) -> None:
    for folder, _, _ in os.walk(top, topdown=False):
        sync_folder(Path(folder))


def sync_folder(folder: Path) -> None:
    """Bring a folder's list of names to the disk."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _tar(folder: Path, manifest: Manifest, limits: Limits) -> Iterable[bytes]:
    top = (manifest.name,)
    yield _header(top, _FOLDER, 0, b"5", limits)
    found = _sources(folder) | {WEBLET_INFO[:1]: None, WEBLET_INFO: None}
    for parts in sorted(found):
        path = found[parts]
        if parts == WEBLET_INFO[:1] or (path is not None and path.is_dir()):
            yield _header(top + parts, _FOLDER, 0, b"5", limits)
            continue
        data = weblet_info(manifest) if path is None else path.read_bytes()
        mode = _PROGRAM if path is not None and path.stat().st_mode & 0o100 else _PLAIN
        yield _header(top + parts, mode, len(data), b"0", limits)
        yield data + bytes(-len(data) % BLOCK)
    yield bytes(2 * BLOCK)


def _sources(folder: Path) -> dict[tuple[str, ...], Path | None]:
    found: dict[tuple[str, ...], Path | None] = {}
    for path in folder.rglob("*"):
        parts = path.relative_to(folder).parts
        if any(part in _IGNORED or part.startswith(".") for part in parts):
            continue
        if path.is_symlink() or not (path.is_file() or path.is_dir()):
            raise Invalid(f"cannot build a package: {'/'.join(parts)} is neither a file nor a folder")
        found[parts] = path
    return found


def _header(parts: tuple[str, ...], mode: int, size: int, kind: bytes, limits: Limits) -> bytes:
    raw = "/".join(parts).encode()
    checked_path(raw, limits)
    prefix, name = _split(parts)
    head = name.ljust(100, b"\0") + b"%07o\0%07o\0%07o\0%011o\0%011o\0" % (mode, 0, 0, size, 0)
    tail = kind + bytes(100) + b"ustar\x0000" + bytes(64) + b"%07o\0%07o\0" % (0, 0) + prefix.ljust(155, b"\0")
    block = (head + b" " * 8 + tail).ljust(BLOCK, b"\0")
    return block[:148] + b"%06o\0 " % sum(block) + block[156:]


def _split(parts: tuple[str, ...]) -> tuple[bytes, bytes]:
    for cut in range(len(parts)):
        prefix, name = "/".join(parts[:cut]).encode(), "/".join(parts[cut:]).encode()
        if len(name) <= 100 and len(prefix) <= 155:
            return prefix, name
    raise Invalid(f"cannot build a package: the path {'/'.join(parts)[:80]} is too long")
