"""Phases of an activation, from stamps that are given."""

import pytest

from benchmarks.phases import (
    ACTIVATING,
    DOWNLOADED,
    DOWNLOADING,
    FIRST_CALL,
    FIRST_WORD,
    INSTALLED,
    SOUND_ENDED,
    SPEECH_ENDED,
    TAKEN,
    UNDERSTOOD,
    VERIFIED,
    Stamp,
    between,
    durations,
    marks,
    timeline,
)


def entered(at: float, state: str, agent: str = "core") -> Stamp:
    return Stamp(at, agent, state, "entered", "")


def message(at: float, detail: str) -> Stamp:
    return Stamp(at, "core", "s6", "message", detail)


INSTALLED_RAPP = [
    entered(9.0, "s3"),
    entered(10.6, "s4"),
    entered(10.7, "s6"),
    entered(10.8, "s7"),
    entered(10.85, "s7", "dynamic"),
    message(11.0, "dynamic->core first_word (asynchronous)"),
    message(11.1, "dynamic->core rapp_say"),
    message(11.2, "dynamic->core rapp_recognize"),
]
DOWNLOAD = [
    message(10.72, "link->core downloading (asynchronous)"),
    message(10.73, "link->core downloading (asynchronous)"),
    message(10.731, "repository->link reply GET targets.json"),
    message(10.735, "repository->link reply GET clock-1.0.0.hz"),
    message(10.74, "link->core verified (asynchronous)"),
    message(10.75, "link->core installed (asynchronous)"),
]


def test_installed_rapp_has_no_marks_of_a_download() -> None:
    found = marks(10.0, [10.5], INSTALLED_RAPP)
    assert found == {
        SPEECH_ENDED: 10.0,
        SOUND_ENDED: 10.5,
        TAKEN: 10.6,
        UNDERSTOOD: 10.7,
        ACTIVATING: 10.8,
        FIRST_WORD: 11.0,
        FIRST_CALL: 11.1,
    }


def test_fresh_rapp_has_the_first_of_each_mark() -> None:
    found = marks(10.0, [10.5], INSTALLED_RAPP + DOWNLOAD)
    assert (found[DOWNLOADING], found[DOWNLOADED], found[VERIFIED], found[INSTALLED]) == (10.72, 10.735, 10.74, 10.75)


def test_end_of_sound_is_the_last_before_the_command_was_taken() -> None:
    assert marks(10.0, [9.5, 10.3, 10.5, 11.5], INSTALLED_RAPP)[SOUND_ENDED] == 10.5


def test_what_was_before_the_end_of_speech_does_not_count() -> None:
    before = [message(8.0, "dynamic->core first_word (asynchronous)"), entered(8.5, "s7")]
    assert marks(10.0, [10.5], before + INSTALLED_RAPP) == marks(10.0, [10.5], INSTALLED_RAPP)


@pytest.mark.parametrize(("ends", "stamps"), [([], INSTALLED_RAPP), ([10.5], INSTALLED_RAPP[:-2])])
def test_a_missing_mark_is_an_error(ends: list[float], stamps: list[Stamp]) -> None:
    with pytest.raises(ValueError, match="cannot time"):
        marks(10.0, ends, stamps)


def test_durations_add_up() -> None:
    activation = marks(10.0, [10.5], INSTALLED_RAPP + DOWNLOAD)
    took = durations(activation)
    assert sum(took.values()) == pytest.approx(1.1)
    assert took[FIRST_CALL] == pytest.approx(0.1)


def test_timeline_gives_medians_of_marks_that_all_have() -> None:
    first = {SPEECH_ENDED: 0.0, SOUND_ENDED: 0.4, TAKEN: 0.5, FIRST_CALL: 1.0}
    second = {SPEECH_ENDED: 10.0, SOUND_ENDED: 10.6, TAKEN: 10.7, FIRST_CALL: 11.4}
    third = {SPEECH_ENDED: 20.0, SOUND_ENDED: 20.5, TAKEN: 20.9, UNDERSTOOD: 21.0, FIRST_CALL: 21.1}
    lines = timeline([first, second, third])
    assert list(lines) == [SOUND_ENDED, TAKEN, FIRST_CALL]
    assert lines[SOUND_ENDED] == (pytest.approx(0.5), pytest.approx(0.5))
    assert lines[FIRST_CALL][1] == pytest.approx(1.1)
    assert between([first, second, third], SOUND_ENDED, FIRST_CALL) == pytest.approx(0.6)
