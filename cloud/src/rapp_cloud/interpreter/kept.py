"""Vectors of texts on the disk, so that each is worked out once, by one of the workers, and none again after a restart.

A cache: one file of records of equal length that all workers share and only ever add to. A file that is not as it must
be, or has grown too long, is begun anew; who has the one of before open goes on with it. Where the disk is unwilling, the
vectors stay in memory.
"""

import fcntl
import hashlib
import logging
import mmap
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

WIDTH = 384  # numbers of a vector
MOST = 200_000  # records; then it is begun anew, for of what is not on offer any more nothing else goes
_RECORD = np.dtype([("key", "V16"), ("vector", "<f2", (WIDTH,))])
_log = logging.getLogger(__name__)

Vectors = NDArray[np.float32]


class KeptVectors:
    """Vectors of length 1 by text, with half precision."""

    def __init__(self, file: Path | None) -> None:
        """Open the file, or make it; its folder must be there.

        :param file: None: in memory only
        """
        self._path = file
        self._handle: int | None = None
        self._adds = file is not None  # to the file
        self._rows: dict[bytes, int] = {}
        self._count = 0  # records read
        self._beside: dict[bytes, NDArray[np.float16]] = {}  # those that are in no file
        try:
            self._open()
        except OSError as error:
            self._give_up(error)

    def missing(self, texts: Sequence[str]) -> list[str]:
        """Return those whose vectors are not known, each once."""
        wanted = {text: _key(text) for text in texts}
        self._read()
        if self._adds and self._count >= MOST and not all(map(self._has, wanted.values())):
            try:
                self._begin_anew()
            except OSError as error:
                self._give_up(error)
        return [text for text, key in wanted.items() if not self._has(key)]

    def take(self, texts: Sequence[str]) -> Vectors:
        """Return the vectors of texts that are known, a row each."""
        found = np.empty((len(texts), WIDTH), np.float32)
        keys = [_key(text) for text in texts]
        filed = [(place, self._rows[key]) for place, key in enumerate(keys) if key in self._rows]
        if filed and self._handle is not None:
            # By the descriptor: another file may have taken the path.
            data = mmap.mmap(self._handle, self._count * _RECORD.itemsize, access=mmap.ACCESS_READ)
            places, rows = zip(*filed, strict=True)
            found[list(places)] = np.frombuffer(data, _RECORD)["vector"][list(rows)]
        for place, key in enumerate(keys):
            if key not in self._rows:
                found[place] = self._beside[key]
        return found

    def add(self, texts: Sequence[str], vectors: Vectors) -> None:
        """Keep the vectors of these, a row each."""
        records = np.zeros(len(texts), _RECORD)
        records["key"] = [_key(text) for text in texts]
        records["vector"] = vectors
        if self._adds:
            try:
                self._append(records[_right(records)].tobytes())
            except OSError as error:
                self._give_up(error)
            self._read()
        for record in records:
            key = bytes(record["key"])
            if key not in self._rows:
                self._beside[key] = record["vector"].copy()

    def _has(self, key: bytes) -> bool:
        return key in self._rows or key in self._beside

    def _open(self) -> None:
        if self._path is None:
            return
        self._handle = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        self._rows, self._count = {}, 0
        if os.fstat(self._handle).st_size > MOST * _RECORD.itemsize or not self._read():
            self._begin_anew()

    def _begin_anew(self) -> None:
        """Leave this file; it is taken away unless another worker has done so, whose new file must stay."""
        if self._path is None or self._handle is None:
            return
        with _locked(self._handle):
            if _lies_at(self._path, self._handle):
                _log.warning("%s is begun anew", self._path)
                self._path.unlink()
        os.close(self._handle)
        self._handle, self._rows, self._count = None, {}, 0
        self._open()

    def _read(self) -> bool:
        """Take what has been added, by whichever worker; false when some of it is not right, which is left out."""
        if self._handle is None:
            return True
        whole = os.fstat(self._handle).st_size // _RECORD.itemsize
        if whole < self._count:  # somebody made it shorter
            self._rows, self._count = {}, 0
        data = os.pread(self._handle, (whole - self._count) * _RECORD.itemsize, self._count * _RECORD.itemsize)
        records = np.frombuffer(data, _RECORD, len(data) // _RECORD.itemsize)
        right, keys = _right(records), records["key"]
        self._rows |= {bytes(keys[place]): self._count + int(place) for place in np.flatnonzero(right)}
        self._count += len(records)
        return bool(np.all(right))

    def _append(self, data: bytes) -> None:
        if self._handle is None:
            return
        with _locked(self._handle):
            size = os.fstat(self._handle).st_size
            if size % _RECORD.itemsize:  # somebody was cut off in the middle of one
                os.ftruncate(self._handle, size - size % _RECORD.itemsize)
            if os.write(self._handle, data) != len(data):
                raise OSError(None, "no space is left")

    def _give_up(self, error: OSError) -> None:
        _log.warning("%s cannot be used (%s): vectors are kept in memory", self._path, error.strerror)
        self._adds = False  # what is in the file is good all the same


def _key(text: str) -> bytes:
    return hashlib.blake2b(text.encode(), digest_size=16).digest()


def _right(records: NDArray[np.void]) -> NDArray[np.bool_]:
    """Tell of each record whether it holds a vector of length 1."""
    lengths = np.linalg.norm(records["vector"].astype(np.float32), axis=1)
    right: NDArray[np.bool_] = np.abs(lengths - 1) < 0.01
    return right


@contextmanager
def _locked(handle: int) -> Iterator[None]:
    fcntl.flock(handle, fcntl.LOCK_EX)
    try:
        yield
    finally:
        fcntl.flock(handle, fcntl.LOCK_UN)


def _lies_at(path: Path, handle: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(handle))
    except FileNotFoundError:
        return False
