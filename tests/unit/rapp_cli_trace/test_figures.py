import pytest

from rapp_cli.errors import CommandError
from rapp_cli.timeline import Entry
from rapp_cli.trace.figures import FIGURES, figure
from rapp_cli.trace.messages import Item, item


def items(*details: str) -> list[Item]:
    found = [item(Entry("core", "core", "s9", "message", detail, 0.0)) for detail in details]
    return [each for each in found if each is not None]


RECOGNISED = items(
    "dynamic->core rapp_recognize", "core->ALSpeechRecognition subscribe", "ALSpeechRecognition->core reply subscribe",
    "dynamic->core rapp_say", "core->ALTextToSpeech say", "link->repository register",
    "ALMemory->core WordRecognized (asynchronous)", "ALMemory->core WordRecognized (asynchronous)",
    "core->dynamic reply rapp_say", "core: a note", "core->dynamic reply rapp_recognize", "dynamic->core terminate (asynchronous)",
)  # fmt: skip


def test_a_figure_shows_its_call_and_its_module_only() -> None:
    assert [each.label for each in figure(RECOGNISED, 6)] == [
        "rapp_recognize", "subscribe", "subscribe", "WordRecognized (2 times)", "rapp_recognize",
    ]  # fmt: skip


def test_seen_from_the_dynamic_agent_it_is_suspended() -> None:
    assert [(each.kind, each.source, each.text) for each in figure(RECOGNISED, 11)] == [
        ("call", "dynamic", "rapp_recognize"), ("note", "dynamic", "suspended"), ("reply", "core", "rapp_recognize"),
    ]  # fmt: skip


def test_the_last_call_that_ended_is_drawn() -> None:
    run = items(
        "dynamic->core rapp_say", "core->dynamic reply rapp_say: invalid", "dynamic->core rapp_say", "core->ALTextToSpeech say",
        "core->dynamic reply rapp_say", "dynamic->core rapp_say",
    )  # fmt: skip
    assert [each.text for each in figure(run, 5)] == ["rapp_say", "say", "rapp_say"]


def test_both_ways_to_record_are_the_figure() -> None:
    run = items("dynamic->core rapp_record_until_silence", "core->dynamic reply rapp_record_until_silence")
    assert len(figure(run, 7)) == 2


@pytest.mark.parametrize("number", FIGURES)
def test_a_run_without_the_call_has_no_such_figure(number: int) -> None:
    with pytest.raises(CommandError, match=f"cannot draw figure {number}: "):
        figure(items("dynamic->core rapp_play_audio", "core->dynamic reply rapp_play_audio"), number)
