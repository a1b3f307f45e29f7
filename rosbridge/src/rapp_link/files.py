"""Which files of the robot may leave it: recordings and pictures in the shared data folder. Blocking."""

import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rapp_hop.errors import Refused

PRIVATE = ("link", "trust", "downloads")  # folders of the data folder that are this process's own


def shared_file(home: Path, text: str) -> Path:
    """Return the real path of a regular file below the robot's data folder.

    :raises Refused: there is none, or it lies elsewhere, links followed
    """
    home = home.resolve()
    if "\0" in text or not Path(text).is_absolute():
        raise Refused(f"cannot use the file {text[:200]!a}: give an absolute path")
    path = Path(text).resolve()
    if not path.is_relative_to(home) or path.relative_to(home).parts[:1] in [(name,) for name in PRIVATE]:
        raise Refused(f"cannot use the file {text[:200]}: it is not in the robot's shared data folder {home}")
    if not path.is_file():
        raise Refused(f"cannot use the file {text[:200]}: there is no such file")
    return path


def sorted_out(home: Path, arguments: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Path]]:
    """Return the plain arguments of a call, and its files: those that are {"file": path}.

    :raises Refused: see `shared_file`
    """
    named = {name: value["file"] for name, value in arguments.items() if isinstance(value, dict) and value.keys() == {"file"}}
    files = {name: shared_file(home, path) for name, path in named.items() if isinstance(path, str)}
    return {name: value for name, value in arguments.items() if name not in files}, files


def read_shared(home: Path, text: str, limit: int) -> tuple[str, bytes]:
    """Return name and content of a shared file.

    :param limit: bytes
    :raises Refused: see `shared_file`, or it is too large
    """
    path = shared_file(home, text)
    try:
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise Refused(f"cannot use the file {text[:200]}: it is not a file any more")
            data = file.read(limit + 1)
    except OSError as error:
        raise Refused(f"cannot read the file {text[:200]}: {error.strerror}") from None
    if len(data) > limit:
        raise Refused(f"cannot send the file {text[:200]}: it has more than {limit} bytes")
    return path.name, data
