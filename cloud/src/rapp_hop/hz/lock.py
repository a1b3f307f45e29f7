"""A lock between processes: a file that one of them holds; the kernel lets go of it when its holder dies."""

import fcntl
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rapp_hop.errors import Unreachable

PATIENCE = 10.0  # seconds


@contextmanager
def held(path: Path, what: str, patience: float = PATIENCE) -> Iterator[None]:
    """Hold the lock while the block runs.

    :param what: is not possible meanwhile, such as "install"
    :param patience: seconds to wait for whoever holds it
    :raises Unreachable: when it is not free in time
    :raises OSError: when the file cannot be made
    """
    end = time.monotonic() + patience
    with path.open("w") as file:
        while True:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() > end:
                    raise Unreachable(f"cannot {what} now: somebody else does, try again") from None
                time.sleep(0.02)
        yield
