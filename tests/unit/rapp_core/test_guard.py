"""How the guard takes the signs of its core agent; what it then does to a robot is in tests/integration/rapp_core/test_guard.py."""

import os
from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from rapp_core.robot.naoqi import guard
from rapp_core.robot.naoqi.guard import DONE, SIGN, watch


class Core:
    """A core agent's end of the pipe; what it does at each silence is given beforehand."""

    def __init__(self, signs: int) -> None:
        self._signs = signs
        self.then = [self.gone]
        self.silences = 0

    def tell(self, word: bytes) -> None:
        os.write(self._signs, word)

    def gone(self) -> None:
        os.close(self._signs)

    def silent(self) -> None:
        self.silences += 1
        self.then.pop(0)()


@pytest.fixture
def pipe(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, Core]]:
    monkeypatch.setattr(guard, "EVERY", 0.005)
    with ExitStack() as stack:
        read, write = os.pipe()
        stack.callback(os.close, read)
        yield read, Core(write)


@pytest.mark.parametrize(("words", "in_order"), [((SIGN, SIGN, DONE), True), ((DONE,), True), ((SIGN, SIGN), False), ((), False)])
def test_only_a_core_agent_that_says_so_has_stopped_the_robot_itself(
    pipe: tuple[int, Core], words: tuple[bytes, ...], in_order: bool
) -> None:
    signs, core = pipe
    for word in words:
        core.tell(word)
    core.gone()
    assert watch(signs, core.silent) is in_order
    assert core.silences == 0


def test_each_silence_is_told_once_whether_the_core_agent_then_goes_on_or_ends(pipe: tuple[int, Core]) -> None:
    signs, core = pipe
    core.then = [lambda: core.tell(SIGN), lambda: core.tell(SIGN), core.gone]
    assert not watch(signs, core.silent)
    assert core.silences == 3


def test_a_core_agent_that_stood_still_may_end_in_order(pipe: tuple[int, Core]) -> None:
    signs, core = pipe

    def end() -> None:
        core.tell(SIGN)
        core.tell(DONE)
        core.gone()

    core.then = [end]
    assert watch(signs, core.silent)
