"""Opens pybullet without its banner on our output."""

import ctypes
import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def connect(window: bool = False) -> Any:
    """pybullet bound to a new world of its own, without graphics or in a window; end it with `disconnect()`."""
    with _silence(1), _silence(2):
        import pybullet

        client = importlib.import_module("pybullet_utils.bullet_client")  # without type information
        return client.BulletClient(pybullet.GUI if window else pybullet.DIRECT)


@contextmanager
def _silence(descriptor: int) -> Iterator[None]:
    """Nothing comes out of a descriptor meanwhile, from C neither."""
    _flush()
    kept, nowhere = os.dup(descriptor), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    try:
        yield
    finally:
        _flush()
        os.dup2(kept, descriptor)
        os.close(kept)
        os.close(nowhere)


def _flush() -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL(None).fflush(None)  # C has buffers of its own
