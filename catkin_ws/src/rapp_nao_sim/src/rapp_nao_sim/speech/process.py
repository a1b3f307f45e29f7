"""The ears' process: pocketsphinx holds the interpreter's lock, so it works beside the host, not in it."""

import logging
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rapp_nao_sim.errors import SimError
from rapp_nao_sim.sound.room import Block
from rapp_nao_sim.world.errors import Refused, Unreachable, WorldError
from rapp_nao_sim.world.worker import Service, Worker, serve

TIMEOUT = 15.0  # s, for one answer of the process
Answer = list[tuple[str, float]]

_log = logging.getLogger(__name__)


class EarsError(SimError):
    """Words cannot be learnt, or a sound is not recognised; ears that died or hang are started anew."""


class Ears:
    """Asks the process; from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._worker = Worker("rapp_nao_sim.speech.process")
        self._wanted = False

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return self._worker.pid

    def start(self) -> None:
        """Start the process."""
        with self._lock:
            self._wanted = True
            self._worker.start()

    def close(self) -> None:
        """End the process."""
        with self._lock:
            self._wanted = False
            self._worker.close()

    def revive(self) -> None:
        """Start the process again if it has ended."""
        with self._lock:
            if self._wanted and not self._worker.alive():
                _log.warning("the ears' process is not there: it is started again")
                self._worker.close()
                self._worker.start()

    def learn(self, vocabulary: Sequence[str]) -> None:
        """Prepare a vocabulary. Raises EarsError, for a phrase nobody can pronounce among others."""
        self._ask("learn", list(vocabulary))

    def recognise(self, vocabulary: Sequence[str], samples: Block) -> Answer:
        """Best phrase of the vocabulary and its probability; [] when nothing like it was heard. Raises EarsError."""
        answer: Answer = self._ask("recognise", list(vocabulary), samples.tobytes())
        return answer

    def _ask(self, verb: str, *args: Any) -> Any:
        try:
            self.revive()
            return self._worker.call(verb, *args, timeout=TIMEOUT)
        except Unreachable as error:
            with self._lock:
                self._worker.close()  # it hangs, or has died: the next question revives it
            raise EarsError(f"cannot {verb}: the ears' process died or hung, and starts again; repeat it") from error
        except WorldError as error:
            raise EarsError(str(error)) from error


class _Recognition:
    """The process's side."""

    def __init__(self, service: Service) -> None:
        from rapp_nao_sim.speech.recogniser import Recogniser

        self._service = service
        self._recogniser = Recogniser()
        self._known: list[str] | None = None
        service.offer({"learn": self._learn, "recognise": self._recognise})

    def run(self) -> None:
        """Answer until the parent leaves."""
        while True:
            self._service.handle()

    def _learn(self, vocabulary: list[str]) -> None:
        if vocabulary == self._known:
            return
        self._known = None
        try:
            self._recogniser.set_vocabulary(vocabulary)
        except SimError as error:
            raise Refused(str(error)) from error
        self._known = vocabulary

    def _recognise(self, vocabulary: list[str], samples: bytes) -> Answer:
        self._learn(vocabulary)
        return self._recogniser.recognise(np.frombuffer(samples, np.int16))


def _build(service: Service) -> Callable[[], None]:
    return _Recognition(service).run


if __name__ == "__main__":
    serve(_build, sys.argv)
