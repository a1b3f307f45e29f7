"""Vectors of texts on the disk, so that each is worked out once, by one of the workers, and none again after a restart.

A cache: one file of records of equal length that all workers share and only ever add to. What is not as it must be is
begun anew; where the disk is unwilling, the vectors stay in memory.
"""

import fcntl
import hashlib
import logging
import os
from collections.abc import Sequence
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
        self._rows: dict[bytes, int] = {}
        self._count = 0  # records read
        self._beside: dict[bytes, NDArray[np.float16]] = {}  # those that are in no file
        try:
            self._open()
        except OSError as error:
            self._give_up(error)

    def missing(self, texts: Sequence[str]) -> list[str]:
        """Return those whose vectors are not known, each once."""
        self._read()
        return [text for text in dict.fromkeys(texts) if not self._has(_key(text))]

    def take(self, texts: Sequence[str]) -> Vectors:
        """Return the vectors of texts that are known, a row each."""
        found = np.empty((len(texts), WIDTH), np.float32)
        keys = [_key(text) for text in texts]
        filed = [(place, self._rows[key]) for place, key in enumerate(keys) if key in self._rows]
        if filed and self._path is not None:
            records = np.memmap(self._path, _RECORD, "r", shape=(self._count,))
            places, rows = zip(*filed, strict=True)
            found[list(places)] = records["vector"][list(rows)]
        for place, key in enumerate(keys):
            if key not in self._rows:
                found[place] = self._beside[key]
        return found

    def add(self, texts: Sequence[str], vectors: Vectors) -> None:
        """Keep the vectors of these, a row each."""
        records = np.zeros(len(texts), _RECORD)
        records["key"] = [_key(text) for text in texts]
        records["vector"] = vectors
        try:
            self._append(records.tobytes())
        except OSError as error:
            self._give_up(error)
        if self._handle is None:
            self._beside |= {bytes(record["key"]): record["vector"].copy() for record in records}
        else:
            self._read()

    def _has(self, key: bytes) -> bool:
        return key in self._rows or key in self._beside

    def _open(self) -> None:
        if self._path is None:
            return
        self._handle = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        self._rows, self._count = {}, 0
        if os.fstat(self._handle).st_size > MOST * _RECORD.itemsize or not self._read():
            _log.warning("%s is begun anew", self._path)
            self._path.unlink()  # others may have it open, and go on with it until they end
            os.close(self._handle)
            self._open()

    def _read(self) -> bool:
        """Take what has been added, by whichever worker; false when it is not right."""
        if self._handle is None:
            return True
        size = os.fstat(self._handle).st_size
        begin = self._count * _RECORD.itemsize
        data = os.pread(self._handle, size // _RECORD.itemsize * _RECORD.itemsize - begin, begin)
        records = np.frombuffer(data, _RECORD, len(data) // _RECORD.itemsize)
        lengths = np.linalg.norm(records["vector"].astype(np.float32), axis=1)
        if not np.all(np.abs(lengths - 1) < 0.01):
            return False
        self._rows |= {bytes(key): self._count + place for place, key in enumerate(records["key"])}
        self._count += len(records)
        return True

    def _append(self, data: bytes) -> None:
        if self._handle is None:
            return
        fcntl.flock(self._handle, fcntl.LOCK_EX)
        try:
            size = os.fstat(self._handle).st_size
            if size % _RECORD.itemsize:  # somebody was cut off in the middle of one
                os.ftruncate(self._handle, size - size % _RECORD.itemsize)
            if os.write(self._handle, data) != len(data):
                raise OSError(None, "no space is left")
        finally:
            fcntl.flock(self._handle, fcntl.LOCK_UN)

    def _give_up(self, error: OSError) -> None:
        _log.warning("%s cannot be used (%s): vectors are kept in memory", self._path, error.strerror)
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


def _key(text: str) -> bytes:
    return hashlib.blake2b(text.encode(), digest_size=16).digest()
