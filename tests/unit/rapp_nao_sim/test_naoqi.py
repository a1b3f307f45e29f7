"""Errors of modules as a client of NAOqi sees them, and the values of futures."""

from concurrent.futures import Future

import pytest

from rapp_nao_sim.naoqi import NaoqiError, promised, quick, working
from rapp_nao_sim.sound.samples import SoundError
from rapp_nao_sim.world.errors import Unreachable

SOON = 5000  # ms


class ALBody:
    """A module."""

    @working
    def slow(self, number, other=1):
        """Divide."""
        return self._do(number, other)

    @quick
    def fast(self, number, other=1):
        return self._do(number, other)

    def _do(self, number, other):
        if isinstance(number, Exception):
            raise number
        return int(number) + other


def outcome(given):
    return given.value(SOON) if hasattr(given, "value") else given


@pytest.mark.parametrize("method", ["slow", "fast"])
def test_values_and_defaults_pass(method):
    assert outcome(getattr(ALBody(), method)(1)) == 2
    assert outcome(getattr(ALBody(), method)("1", 2)) == 3


@pytest.mark.parametrize("method", ["slow", "fast"])
@pytest.mark.parametrize(
    ("argument", "text"),
    [
        (NaoqiError("cannot do it: not now"), "cannot do it: not now"),
        (SoundError("cannot play it"), "cannot play it"),
        (Unreachable("cannot go on: the world has ended"), "cannot go on: the world has ended"),
        ("one", "invalid literal for int() with base 10: 'one'"),
    ],
)
def test_errors_are_below_the_methods_name(method, argument, text):
    with pytest.raises(RuntimeError) as caught:
        outcome(getattr(ALBody(), method)(argument))
    assert str(caught.value) == f"ALBody::{method}\n\t{text}"


@pytest.mark.parametrize("method", ["slow", "fast"])
def test_too_few_arguments_are_an_error(method):
    with pytest.raises(RuntimeError, match=f"ALBody::{method}\n\t.*missing 1 required"):
        outcome(getattr(ALBody(), method)())


def test_a_mistake_of_the_simulator_is_logged_and_told_without_its_inside(caplog):
    with pytest.raises(RuntimeError, match="ALBody::slow\n\tinternal error of the simulator; see its log"):
        outcome(ALBody().slow(ZeroDivisionError("inside")))
    assert "inside" in caplog.text


def test_a_future_of_ours_becomes_one_of_libqi():
    done, failed = Future(), Future()
    waiting = promised("ALBody::wait", done)
    assert not waiting.isFinished()
    done.set_result(True)
    assert waiting.value(SOON) is None
    waiting = promised("ALBody::wait", failed)
    failed.set_exception(NaoqiError("cannot wait"))
    with pytest.raises(RuntimeError, match="ALBody::wait\n\tcannot wait"):
        waiting.value(SOON)
