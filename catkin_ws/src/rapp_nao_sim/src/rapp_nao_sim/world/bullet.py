"""Opens pybullet without its banner on our standard output."""

import ctypes
import os
import sys
from typing import Any


def connect() -> Any:
    """pybullet connected to a world of its own, without graphics: the module bound to that world; end it with `disconnect()`."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        import pybullet
        from pybullet_utils import bullet_client

        return bullet_client.BulletClient(pybullet.DIRECT)
    finally:
        ctypes.CDLL(None).fflush(None)  # the banner waits in C's own buffer
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
