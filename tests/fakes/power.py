"""The power goes after some writes of a store and its keys; all files as they were before."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from rapp_cloud.files import write_whole


class Kept:
    """All files below a folder as they are now."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    def again(self) -> None:
        for folder in ("tuf", "keys", "trust"):
            shutil.rmtree(self._folder / folder, ignore_errors=True)
        for path, data in self._files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            path.chmod(0o600)


class PowerGone(BaseException):
    """Nothing happens after this."""


def cut_after(writes: int, change: Callable[[], None]) -> None:
    left = [writes]

    def limited(original):  # type: ignore[no-untyped-def]
        def write(*args, **kwargs):  # type: ignore[no-untyped-def]
            if not left[0]:
                raise PowerGone
            left[0] -= 1
            original(*args, **kwargs)

        return write

    with pytest.MonkeyPatch.context() as patch:
        for module in ("ledger", "keys"):
            patch.setattr(f"rapp_cloud.{module}.write_whole", limited(write_whole))
        try:
            change()
        except PowerGone:
            return
