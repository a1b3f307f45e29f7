"""Files that appear whole or not at all, and JSON files that somebody else may change meanwhile."""

import io
import os
import secrets
import shutil
from pathlib import Path
from typing import Any, BinaryIO

from rapp_hop import strict_json
from rapp_hop.errors import Refused


def write_whole(path: Path, data: bytes, *, mode: int = 0o644) -> None:
    """Write aside, bring to the disk, rename over; the folder must be there.

    :raises OSError: when the disk refuses; what was there before is still there then
    """
    _write_aside(path, io.BytesIO(data), mode)


def copy_whole(source: Path, path: Path, *, mode: int = 0o644) -> None:
    """Do as `write_whole` with what is in another file, piece by piece."""
    with source.open("rb") as data:
        _write_aside(path, data, mode)


def _write_aside(path: Path, data: BinaryIO, mode: int) -> None:
    aside = path.with_name(f".{path.name}.{secrets.token_hex(6)}")
    handle = os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, mode)
    try:
        with os.fdopen(handle, "wb") as file:
            shutil.copyfileobj(data, file)
            file.flush()
            os.fsync(file.fileno())
        aside.replace(path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def read_json(path: Path, limit: int) -> Any:
    """Return what a JSON file holds.

    :param limit: bytes
    :raises Refused: when it cannot be read
    :raises Invalid: when it is not right JSON
    """
    try:
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except OSError as error:
        raise Refused(f"cannot read {path.name}: {error.strerror}") from None
    return strict_json.loads(data, limit=limit)
