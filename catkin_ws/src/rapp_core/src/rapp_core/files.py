"""Files that appear whole or not at all."""

import os
from pathlib import Path


def aside_of(path: Path) -> Path:
    """Where a file is written before it takes its place; a cut-off writer leaves it there."""
    return path.with_name(f".{path.name}.new")


def write_whole(path: Path, data: bytes) -> Path:
    """Write aside, bring to the disk, rename over; gives the path. Raises OSError: what was there before is still there then."""
    aside = aside_of(path)
    with aside.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    return aside.replace(path)
