"""The ears' process: pocketsphinx holds the interpreter's lock, so it works beside the host, not in it."""

import logging
import multiprocessing as mp
import signal
import threading
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from rapp_nao_sim.sound.room import Block

TIMEOUT = 15.0  # s, for one answer of the process

_log = logging.getLogger(__name__)


class EarsError(Exception):
    """The ears' process does not answer; it is started anew for the next sound."""


def _serve(pipe: Connection) -> None:
    """Answer (vocabulary, samples) with recognised phrases until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from rapp_nao_sim.speech.recogniser import Recogniser

    recogniser = Recogniser()
    known: list[str] | None = None
    while True:
        try:
            vocabulary, samples = pipe.recv()
        except EOFError:
            return
        try:
            if vocabulary != known:
                recogniser.set_vocabulary(vocabulary)
                known = vocabulary
            pipe.send(recogniser.recognise(np.frombuffer(samples, np.int16)) if samples else [])
        except (ValueError, RuntimeError) as error:
            known = None
            pipe.send(error)


class Ears:
    """Asks the process; one question at a time, from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: Any = None
        self._pipe: Connection | None = None

    def start(self) -> None:
        """Start the process, or start it again."""
        context = mp.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), name="ears", daemon=True)
        self._process.start()
        theirs.close()

    def close(self) -> None:
        """End the process."""
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.join(1)
            if self._process.is_alive():
                self._process.kill()
                self._process.join(1)

    def learn(self, vocabulary: Sequence[str]) -> None:
        """Prepare a vocabulary; raises ValueError for a phrase nobody can pronounce, EarsError."""
        self._ask(vocabulary, b"")

    def recognise(self, vocabulary: Sequence[str], samples: Block) -> list[tuple[str, float]]:
        """Best phrase of the vocabulary and its probability; [] when nothing like it was heard. Raises EarsError."""
        result: list[tuple[str, float]] = self._ask(vocabulary, samples.tobytes())
        return result

    def _ask(self, vocabulary: Sequence[str], samples: bytes) -> Any:
        with self._lock:
            try:
                if self._process is None or not self._process.is_alive():
                    _log.warning("the ears' process is not there: starting it")
                    self.start()
                assert self._pipe is not None
                self._pipe.send((list(vocabulary), samples))
                if not self._pipe.poll(TIMEOUT):
                    self._process.kill()
                    raise EarsError(f"cannot recognise: the ears did not answer in {TIMEOUT:g} s; say it again")
                answer = self._pipe.recv()
            except (OSError, EOFError) as error:
                raise EarsError("cannot recognise: the ears' process died; say it again") from error
        if isinstance(answer, Exception):
            raise answer
        return answer
