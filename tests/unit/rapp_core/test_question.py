"""The question after a long command that fits several RApps."""

import pytest

from rapp_core.control.installed import Known
from rapp_core.control.question import which


def known(**keywords: tuple[str, ...]) -> dict[str, Known]:
    return {name: Known(name, "1.0.0", words, None) for name, words in keywords.items()}


@pytest.mark.parametrize(
    ("choice", "text"),
    [
        (["clock", "voice_mail"], "Do you mean clock or voice mail?"),
        (["clock", "voice_mail", "hello"], "Do you mean clock, voice mail or hello?"),
        (["clock", "clock"], "Do you mean clock?"),
    ],
)
def test_names_all_in_their_order(choice: list[str], text: str) -> None:
    assert which(choice, {}).text == text


def test_names_and_keywords_are_answers_and_so_is_no() -> None:
    asked = which(["clock", "voice_mail"], known(clock=("time",), voice_mail=("e-mail",), hello=("hello",)))
    assert asked.answers == {
        "clock": "clock", "voice mail": "voice_mail", "time": "clock", "e-mail": "voice_mail", "no": None, "neither": None,
    }  # fmt: skip


def test_a_keyword_of_both_answers_nothing() -> None:
    assert "play" not in which(["chess", "draughts"], known(chess=("play",), draughts=("play",))).answers


def test_a_name_goes_before_the_other_s_keyword() -> None:
    assert which(["mail", "voice_mail"], known(mail=(), voice_mail=("mail",))).answers["mail"] == "mail"


def test_a_rapp_called_no_can_be_meant() -> None:
    assert which(["no", "yes"], {}).answers["no"] == "no"
