"""The body of a call, sent piece by piece: files are read while they are sent, never held whole."""

import asyncio
import secrets
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import quote

from rapp_hop import strict_json
from rapp_hop.errors import Refused

MAX_UPLOAD = 512 * 2**20  # bytes of one request with its files
PIECE = 256 * 1024  # bytes
ASK_FIRST = 512 * 1024  # bytes from which on the server is asked before the body is sent, and the body is sent in pieces

Write = Callable[[bytes], Awaitable[None]]


@dataclass(frozen=True)
class Field:
    """One part of a multipart body: plain data, or a file."""

    head: bytes
    data: bytes
    file: Path | None = None
    size: int = 0


@dataclass(frozen=True)
class Parcel:
    """A body with its type and length."""

    content_type: str
    fields: tuple[Field, ...]
    tail: bytes
    length: int

    async def whole(self) -> bytes:
        """Return the body; for short ones.

        :raises Refused: as `send`
        """
        pieces: list[bytes] = []

        async def keep(piece: bytes) -> None:
            pieces.append(piece)

        await self.send(keep)
        return b"".join(pieces)

    async def send(self, write: Write) -> None:
        """Write the body.

        :raises Refused: when a file has changed its size, or cannot be read any more
        """
        for field in self.fields:
            await write(field.head + field.data)
            if field.file is not None:
                await _send_file(write, field.file, field.size)
                await write(b"\r\n")
        await write(self.tail)


def pack_json(args: Mapping[str, Any]) -> Parcel:
    """Return the body of a call without files."""
    data = strict_json.dumps(dict(args)).encode()
    return Parcel("application/json", (Field(b"", data),), b"", len(data))


async def pack_multipart(texts: Mapping[str, tuple[str, bytes]], files: Mapping[str, Path]) -> Parcel:
    """Return the body of a call with files.

    :param texts: content type and data by field
    :raises Refused: when a file cannot be read, or all are too long together
    """
    boundary = secrets.token_hex(16)
    fields = [Field(_head(boundary, f'name="{quote(name)}"', kind), data + b"\r\n") for name, (kind, data) in texts.items()]
    for name, path in files.items():
        size = await asyncio.to_thread(_size, path)
        head = _head(boundary, f'name="{quote(name)}"; filename="{quote(path.name)}"', "application/octet-stream")
        fields.append(Field(head, b"", path, size))
    tail = f"--{boundary}--\r\n".encode()
    length = sum(len(field.head) + len(field.data) + (field.size + 2 if field.file else 0) for field in fields) + len(tail)
    if length > MAX_UPLOAD:
        raise Refused(f"cannot upload {length} bytes: at most {MAX_UPLOAD} are allowed")
    return Parcel(f"multipart/form-data; boundary={boundary}", tuple(fields), tail, length)


def _head(boundary: str, field: str, kind: str) -> bytes:
    return f"--{boundary}\r\nContent-Disposition: form-data; {field}\r\nContent-Type: {kind}\r\n\r\n".encode()


def _size(path: Path) -> int:
    try:
        with path.open("rb"):
            return path.stat().st_size
    except OSError as error:
        raise Refused(f"cannot upload {path.name}: {error.strerror}") from None


async def _send_file(write: Write, path: Path, size: int) -> None:
    file = await asyncio.to_thread(_open, path)
    with file:
        left = size
        while left:
            piece = await asyncio.to_thread(file.read, min(left, PIECE))
            if not piece:
                raise Refused(f"cannot upload {path.name}: it became shorter while it was sent")
            left -= len(piece)
            await write(piece)


def _open(path: Path) -> BinaryIO:
    try:
        return path.open("rb")
    except OSError as error:
        raise Refused(f"cannot upload {path.name}: {error.strerror}") from None
