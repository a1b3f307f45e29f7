"""A long command that fits several RApps: the robot asks which."""

import pytest

from fakes.core_home import QUESTION, Home, ask_what_fits_two

ASKED = ["s3", "s5", "s12", "s6", "s7", "s8", "s9", "s10", "s3"]


@pytest.mark.parametrize(
    ("answer", "rapp"),
    [("clock", "clock"), ("alarm clock", "alarm_clock"), ("what time is it", "clock"), ("wake me", "alarm_clock")],
)
def test_when_a_long_command_fits_two_it_asks_which_and_goes_on(home: Home, answer: str, rapp: str) -> None:
    ask_what_fits_two(home, answer)
    assert home.round() == ASKED
    assert home.fake.said() == [QUESTION]
    assert ("install", {"name": rapp}) in home.link.asked


@pytest.mark.parametrize(
    ("answer", "words"),
    [(None, "I did not understand you"), ("no", "All right, I do nothing"), ("hello", "I did not understand you")],
)
def test_without_an_answer_to_its_question_it_gives_up_after_a_bound(home: Home, answer: str | None, words: str) -> None:
    ask_what_fits_two(home, answer)
    begun = home.clock.time
    assert home.round() == ["s3", "s5", "s12", "s11", "s3"]
    assert home.fake.said() == [QUESTION, words]
    assert home.clock.time - begun <= home.config.recognise_timeout + 0.5
    assert "install" not in home.link.names()


def test_told_to_end_it_waits_for_no_answer(home: Home) -> None:
    ask_what_fits_two(home, None)
    home.clock.after(1.0, home.stop.set)
    begun = home.clock.time
    home.machine.step(home.share)
    assert home.clock.time - begun < 1.2
