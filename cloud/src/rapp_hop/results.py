"""What a service may return beside JSON: a file, or a stream of pieces (`Path` alone is a file of unknown type)."""

from collections.abc import AsyncIterable, Iterable
from dataclasses import dataclass
from pathlib import Path

ANY_TYPE = "application/octet-stream"


@dataclass(frozen=True)
class File:
    """A file to send."""

    path: Path
    content_type: str = ANY_TYPE
    name: str = ""  # offered to who saves it
    remove: bool = False  # when it is sent, or could not be


@dataclass(frozen=True)
class Stream:
    """Pieces to send as they come; when the iterator fails the connection is cut, so that nobody takes the part for all."""

    pieces: AsyncIterable[bytes] | Iterable[bytes]
    content_type: str = ANY_TYPE
    name: str = ""
