"""The robot's file system as clients see it: they may write in some folders only, as on a real robot."""

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rapp_nao_sim.naoqi import NaoqiError


class Files:
    """Folders in which clients of NAOqi may write."""

    def __init__(self, folders: Sequence[Path]) -> None:
        self._folders = [folder.resolve() for folder in folders]

    def writable(self, name: str) -> Path:
        """The path to write at; an error outside the folders, or when its folder is missing."""
        path = Path(name).resolve()
        if not any(path.is_relative_to(folder) for folder in self._folders):
            raise NaoqiError(f"cannot write {name}: outside {', '.join(map(str, self._folders))}")
        if not path.parent.is_dir():
            raise NaoqiError(f"cannot write {name}: its folder does not exist")
        if path.is_dir():
            raise NaoqiError(f"cannot write {name}: it is a folder")
        return path


def write(path: Path, data: bytes) -> None:
    """Write aside, then rename: nobody sees half a file. Raises NaoqiError."""
    try:
        descriptor, aside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        Path(aside).chmod(0o644)
        Path(aside).replace(path)
    except OSError as error:
        raise NaoqiError(f"cannot write {path}: {error.strerror}") from error
