"""A reader of gzipped tar that knows regular files and folders and nothing else. No disk.

Own code because Debian 12's `tarfile` has no extraction filter and believes far more than a package needs. What this
reader believes: one gzip member; POSIX or GNU ustar headers with a right checksum and octal numbers; types file and
folder. Everything else (links, devices, sparse files, pax and GNU long names, bytes after the end) is refused.
The numbers P01 … P25 are those of the project's list of hostile packages.
"""

import unicodedata
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

from rapp_hop.errors import Invalid
from rapp_hop.hz.text import check_text

BLOCK = 512  # bytes
_PIECE = 64 * 1024  # bytes
_SPECIAL_BITS = 0o7000  # setuid, setgid, sticky


@dataclass(frozen=True)
class Limits:
    """How much of a package is believed."""

    packed: int = 64 * 2**20  # bytes of the .hz
    unpacked: int = 256 * 2**20  # bytes of all that comes out of gzip
    members: int = 2000  # files and folders
    depth: int = 8  # folders inside folders
    name: int = 100  # bytes of one name in a path


@dataclass(frozen=True)
class Member:
    """One file or folder; `path` is relative, checked, in parts."""

    path: tuple[str, ...]
    folder: bool
    size: int  # bytes
    executable: bool


class TarReader:
    """Gives the members of a gzipped tar in order; take a file's bytes before going on to the next member."""

    def __init__(self, source: BinaryIO, limits: Limits) -> None:
        self._stream = _Gunzip(source, limits)
        self._limits = limits
        self._paths = _Paths()
        self._left = 0  # bytes of the present member not yet taken
        self._padding = 0

    def members(self) -> Iterator[Member]:
        """Yield each member; after the last one the whole input was read and found right.

        :raises Invalid: at the first thing that is not believed
        """
        count = 0
        while True:
            self._skip_rest()
            block = self._stream.take(BLOCK)
            if block == bytes(BLOCK):
                break
            count += 1
            if count > self._limits.members:
                raise Invalid(f"cannot unpack: more than {self._limits.members} files and folders")
            member = self._member(block)
            self._left = member.size
            self._padding = -member.size % BLOCK
            yield member
        self._stream.only_zeros()

    def data(self) -> Iterator[bytes]:
        """Yield the bytes of the present member in pieces."""
        while self._left:
            piece = self._stream.take(min(self._left, _PIECE))
            self._left -= len(piece)
            yield piece

    def _skip_rest(self) -> None:
        for _ in self.data():
            pass
        self._stream.take(self._padding)
        self._padding = 0

    def _member(self, block: bytes) -> Member:
        if block[257:262] != b"ustar" or _number(block[148:156]) != sum(block[:148] + b" " * 8 + block[156:]):
            raise Invalid("cannot unpack: a header is damaged or this is no tar")
        kind = block[156:157]
        if kind not in (b"0", b"\0", b"5"):
            raise Invalid(f"cannot unpack: member of type {kind!r}, only files and folders are allowed")
        mode, size = _number(block[100:108]), _number(block[124:136])
        if mode & _SPECIAL_BITS:
            raise Invalid("cannot unpack: a member has the setuid, setgid or sticky bit")
        name = _field(block[0:100])
        prefix = _field(block[345:500]) if block[262:265] == b"\x0000" else b""
        raw = prefix + b"/" + name if prefix else name
        folder = kind == b"5"
        if folder and size:
            raise Invalid("cannot unpack: a folder has bytes")
        path = checked_path(raw, self._limits, folder=folder)
        self._paths.add(path, folder=folder)
        return Member(path, folder, size, executable=bool(mode & 0o100))


def checked_path(raw: bytes, limits: Limits, *, folder: bool = False) -> tuple[str, ...]:
    """Return the parts of a member's path when each rule for names holds (P01 to P06, P16).

    :raises Invalid: traversal, absolute, backslash, drive letter, control or invisible sign, not UTF-8, too long, deep
    """
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        raise Invalid("cannot unpack: a name is not UTF-8") from None
    if folder:
        text = text.removesuffix("/")
    parts = tuple(text.split("/"))
    if len(parts) > limits.depth:
        raise Invalid(f"cannot unpack: folders deeper than {limits.depth}")
    for part in parts:
        if part in ("", ".", "..") or any(sign in part for sign in '\\:*?"<>|') or part != part.strip(" "):
            raise Invalid(f"cannot unpack: path {text[:80]!r} is not a plain path inside the package")
        check_text(part, limits.name, f"path {text[:80]!r}")
        if len(part.encode()) > limits.name:
            raise Invalid(f"cannot unpack: a name is longer than {limits.name} bytes")
    return parts


class _Paths:
    """Every path seen, so that nothing comes twice, in two spellings, or as file and folder (P14 to P16)."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, ...], tuple[tuple[str, ...], bool]] = {}
        self._listed: set[tuple[str, ...]] = set()

    def add(self, path: tuple[str, ...], *, folder: bool) -> None:
        for length in range(1, len(path)):
            self._note(path[:length], folder=True)
        self._note(path, folder=folder)
        if path in self._listed:
            raise Invalid(f"cannot unpack: {'/'.join(path)} comes twice")
        self._listed.add(path)

    def _note(self, path: tuple[str, ...], *, folder: bool) -> None:
        key = tuple(unicodedata.normalize("NFKC", part).casefold() for part in path)
        spelt, was_folder = self._seen.setdefault(key, (path, folder))
        if spelt != path:
            raise Invalid(f"cannot unpack: {'/'.join(path)} and {'/'.join(spelt)} differ only in their spelling")
        if was_folder != folder:
            raise Invalid(f"cannot unpack: {'/'.join(path)} is a file and a folder")


class _Gunzip:
    """Bytes out of one gzip member, with bounds on what goes in and comes out (P17, P20)."""

    def __init__(self, source: BinaryIO, limits: Limits) -> None:
        self._source = source
        self._limits = limits
        self._inflate = zlib.decompressobj(wbits=31)
        self._waiting = bytearray()
        self._in = 0
        self._out = 0

    def take(self, count: int) -> bytes:
        """Return exactly `count` bytes."""
        while len(self._waiting) < count:
            if not self._more():
                raise Invalid("cannot unpack: it is cut off")
        piece = bytes(self._waiting[:count])
        del self._waiting[:count]
        return piece

    def only_zeros(self) -> None:
        """Read to the end: zeros of the tar, then the end of the gzip member, then nothing."""
        while True:
            if any(self._waiting):
                raise Invalid("cannot unpack: bytes after the end of the tar")
            self._waiting.clear()
            if not self._more():
                break
        if self._inflate.unused_data or self._source.read(1):
            raise Invalid("cannot unpack: bytes after the end of the gzip")

    def _more(self) -> bool:
        if self._inflate.eof:
            return False
        data = self._inflate.unconsumed_tail
        if not data:
            data = self._source.read(_PIECE)
            self._in += len(data)
        try:
            piece = self._inflate.decompress(data, _PIECE)
        except zlib.error:
            raise Invalid("cannot unpack: it is not a gzip or damaged") from None
        if not data and not piece and not self._inflate.eof:
            raise Invalid("cannot unpack: the gzip is cut off")
        self._out += len(piece)
        if self._in > self._limits.packed or self._out > self._limits.unpacked:
            raise Invalid(f"cannot unpack: larger than {self._limits.packed} packed or {self._limits.unpacked} bytes")
        self._waiting += piece
        return True


def _field(raw: bytes) -> bytes:
    text, _, rest = raw.partition(b"\0")
    if any(rest):
        raise Invalid("cannot unpack: a name holds a NUL")
    return text


def _number(raw: bytes) -> int:
    digits = raw.strip(b" \0")
    if not digits or any(sign not in b"01234567" for sign in digits):
        raise Invalid("cannot unpack: a number in a header is not octal")
    return int(digits, 8)
