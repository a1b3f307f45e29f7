"""Writes that survive a power cut: aside, fsync, rename, fsync of the folder."""

import os
import secrets
import shutil
from pathlib import Path

ASIDE = ".aside-"  # begin of the name of everything that is not finished


class Disk:
    """The few operations that change files; each one happens or does not (a port, so that tests can cut the power)."""

    def write(self, path: Path, data: bytes) -> None:
        """Write a new file and bring it to the disk; it may be torn after a power cut."""
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())

    def make_folder(self, path: Path) -> None:
        """Make a private folder."""
        path.mkdir(mode=0o700)

    def rename(self, source: Path, target: Path) -> None:
        """Put a finished file or folder in its place and bring the folder to the disk."""
        self.sync_folder(source if source.is_dir() else source.parent)
        source.replace(target)
        self.sync_folder(target.parent)

    def remove(self, path: Path) -> None:
        """Remove a file or a whole folder; one that is not there is fine."""
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)

    def sync_folder(self, path: Path) -> None:
        """Bring a folder's list of names to the disk."""
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def replace_whole(disk: Disk, path: Path, data: bytes) -> None:
    """Give a file new content, all or nothing."""
    aside = new_aside(path.parent)
    try:
        disk.write(aside, data)
        disk.rename(aside, path)
    except OSError:
        disk.remove(aside)
        raise


def new_aside(folder: Path) -> Path:
    """Return a name for something not finished yet."""
    return folder / f"{ASIDE}{secrets.token_hex(8)}"


def sweep(disk: Disk, folder: Path) -> None:
    """Remove what a power cut left unfinished in a folder."""
    for path in folder.glob(f"{ASIDE}*"):
        disk.remove(path)
