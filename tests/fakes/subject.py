"""What a worker process of the tests holds."""

import os
import signal
import time


class Subject:
    def __init__(self) -> None:
        self._calls = 0

    def count(self) -> tuple[int, int]:
        self._calls += 1
        return self._calls, os.getpid()

    def fail(self, text: str) -> None:
        raise ValueError(text)

    def hang(self) -> None:
        time.sleep(600)

    def die(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)
