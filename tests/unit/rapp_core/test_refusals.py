"""The robot has words of its own for every attack that its link can name."""

from rapp_core.control.refusals import AWAY, not_activated, not_installed
from rapp_core.errors import NO_RUNTIME, CoreError, Refused, Unreachable
from rapp_hop.hz.attacks import Attack


def said(error: CoreError, reason: str = "") -> str:
    error.reason = reason
    return not_installed("voice_mail", error)


def test_every_attack_is_said_in_words_of_its_own() -> None:
    words = {said(Refused("no"), attack.value) for attack in Attack}
    assert len(words) == len(Attack)
    assert all(text.startswith("I refuse to install voice mail, ") for text in words)


def test_slow_retrieval_is_said_though_it_may_be_tried_again() -> None:
    assert said(Unreachable("later"), Attack.SLOW.value) == "I refuse to install voice mail, it comes too slowly"


def test_without_a_reason() -> None:
    assert said(Unreachable("away")) == AWAY
    assert said(Refused("disk full")) == "I cannot install voice mail"


def test_a_rapp_in_a_language_that_is_not_here() -> None:
    error = Refused("cannot start probe: it is written in JavaScript")
    assert not_activated(error) == "I cannot start it"
    error.reason = NO_RUNTIME
    assert not_activated(error) == "I cannot start it, I lack what it is written in"
