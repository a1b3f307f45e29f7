import json
from collections.abc import Sequence
from dataclasses import asdict

import pytest

from rapp_cli.errors import CommandError
from rapp_cli.timeline import Entry
from rapp_cli.trace.messages import LONGEST, Item, entries, folded, item, last_run, pairs, squeezed


def core(kind: str, state: str = "s9", detail: str = "", time: float = 0.0) -> Entry:
    return Entry("core", "core", state, kind, detail, time)


def told(detail: str, time: float = 0.0) -> Entry:
    return core("message", detail=detail, time=time)


def person(words: str, time: float) -> Entry:
    return Entry("person", "", "", "said", words, time)


def run(begin: float, *inside: Entry) -> list[Entry]:
    """Heard at `begin`, served, listening again 9 s later."""
    return [core("left", "s3", time=begin), *inside, core("entered", "s3", "listen", begin + 9)]


def texts(items: Sequence[Item]) -> list[str]:
    return [each.text for each in items]


@pytest.mark.parametrize(
    ("detail", "kind", "source", "target", "text"),
    [
        ("dynamic->core rapp_say", "call", "dynamic", "core", "rapp_say"),
        ("core->ALMemory say it", "call", "core", "ALMemory", "say it"),
        ("core->dynamic dismantle (asynchronous)", "send", "core", "dynamic", "dismantle"),
        ("mail-server->link reply mail (SMTP): taken", "reply", "mail-server", "link", "mail (SMTP): taken"),
        ("link->mail-server mail (SMTP)", "call", "link", "mail-server", "mail (SMTP)"),
        ("core->link replying", "call", "core", "link", "replying"),
        ("link: no answer to profile", "note", "link", "link", "no answer to profile"),
        ("something else", "note", "core", "core", "something else"),
    ],
)
def test_the_form_of_messages_is_read(detail: str, kind: str, source: str, target: str, text: str) -> None:
    found = item(told(detail))
    assert found is not None
    assert (found.kind, found.source, found.target, found.text) == (kind, source, target, text)


@pytest.mark.parametrize(
    ("entry", "kind", "source", "target", "text"),
    [
        (person("e-mail", 0), "send", "person", "core", "“e-mail”"),
        (core("said", detail="hello"), "send", "core", "person", "“hello”"),
        (core("heard", detail="e-mail"), "note", "core", "core", "heard “e-mail”"),
        (core("entered", "s4", "keyword"), "state", "core", "core", "s4 keyword"),
        (core("failed", "s6", "no such RApp"), "note", "core", "core", "s6 failed: no such RApp"),
    ],
)
def test_words_and_states_are_shown(entry: Entry, kind: str, source: str, target: str, text: str) -> None:
    found = item(entry)
    assert found is not None
    assert (found.kind, found.source, found.target, found.text) == (kind, source, target, text)


@pytest.mark.parametrize("entry", [core("left"), core("entered", "s9/say", "delegate"), core("failed", "s9/say", "no")])
def test_the_steps_of_a_core_service_are_not_shown(entry: Entry) -> None:
    assert item(entry) is None


def test_what_is_heard_comes_from_the_person_when_nobody_tells_what_the_person_says() -> None:
    assert item(core("heard", detail="e-mail"), spoken=False) == Item("send", "person", "core", "“e-mail”", 0.0)


def test_a_text_has_no_control_characters_and_an_end() -> None:
    found = item(core("said", detail="a\x00\n b" + "c" * 300))
    assert found is not None
    assert found.text.startswith("“a b")
    assert len(found.text) == LONGEST + 2


def test_the_last_run_is_from_the_command_until_it_listens_again() -> None:
    record = [
        core("entered", "s3", "listen", 0),
        core("heard", "s3", "first", 1), *run(1, told("core->link install first")),
        person("not understood", 11), core("message", "s3", "core->link register", 12), person("second", 13),
        core("heard", "s3", "second", 14), *run(14, told("core->link install second", 15)),
        core("message", "s3", "core->link register", 30), person("third", 31),
    ]  # fmt: skip
    assert texts(last_run(record)) == ["“second”", "heard “second”", "install second", "s3 listen"]


def test_a_run_that_goes_on_is_drawn_as_far_as_it_is() -> None:
    assert texts(last_run([*run(0)[:1], told("core->link install it")])) == ["install it"]


def test_a_run_ends_where_a_new_core_agent_begins() -> None:
    record = [core("left", "s3"), told("dynamic->core rapp_say"), core("entered", "s1", "initialise"), told("core->link register")]
    assert texts(last_run(record)) == ["rapp_say", "s1 initialise"]


def test_with_a_real_person_what_was_heard_is_what_was_said() -> None:
    record = [core("entered", "s3"), core("heard", "s3", "e-mail"), *run(1, core("heard", detail="Elizabeth"))]
    assert [(each.source, each.text) for each in last_run(record)][:2] == [("person", "“e-mail”"), ("person", "“Elizabeth”")]


def test_without_a_run_there_is_nothing_to_draw() -> None:
    with pytest.raises(CommandError, match="say something"):
        last_run([core("entered", "s3", "listen")])


def lines(*found: Entry) -> list[str]:
    return [json.dumps(asdict(entry)) for entry in found]


def test_what_the_person_says_is_put_where_it_belongs_and_the_agents_keep_their_order() -> None:
    written = lines(told("a", 1.0), told("b", 0.9), told("d", 3.0), person("c", 2.0))
    assert [entry.detail for entry in entries(written, "record")] == ["a", "b", "c", "d"]


def test_a_line_that_is_being_written_is_left_out() -> None:
    assert [entry.detail for entry in entries([*lines(told("a")), '{"agent": "co'], "record")] == ["a"]


GOOD = lines(told("x"))[0]


@pytest.mark.parametrize(
    "line",
    [
        "", "{", "[]", "{}", '{"agent": "core"}',
        GOOD.replace('"message"', '"mass"'), GOOD.replace('"x"', "1"), GOOD.replace("0.0", '"noon"'),
    ],
)  # fmt: skip
def test_a_broken_record_is_told_with_its_line(line: str) -> None:
    with pytest.raises(CommandError, match=r"cannot read record: line 2 is broken"):
        entries([*lines(told("a")), line, *lines(told("b"))], "record")


def message(kind: str, source: str, target: str, text: str) -> Item:
    found = item(told(f"{source}->{target} {'reply ' if kind == 'reply' else ''}{text}"))
    assert found is not None
    return found


def test_a_message_again_and_again_is_one() -> None:
    found = squeezed([message("call", "a", "b", "x")] * 3 + [message("call", "a", "b", "y")])
    assert [(each.label, each.times) for each in found] == [("x (3 times)", 3), ("y", 1)]


def test_replies_find_their_calls() -> None:
    items = [
        message("call", "a", "b", "x"), message("call", "b", "c", "x"), message("call", "a", "b", "xx"),
        message("reply", "b", "a", "xx: done"), message("reply", "c", "b", "x"), message("reply", "c", "b", "x"),
        message("reply", "b", "a", "x"), message("call", "a", "b", "never answered"),
    ]  # fmt: skip
    assert pairs(items) == [(0, 6), (1, 4), (2, 3)]


POSE = [message("call", "dynamic", "core", "rapp_get_robot_pose"), message("reply", "core", "dynamic", "rapp_get_robot_pose")]
WALK = message("call", "dynamic", "core", "rapp_move_to")
ASKED = message("call", "core", "ALMotion", "moveTo")
STATE = Item("state", "dynamic", "dynamic", "s33 walk", 0.0)


def labels(items: Sequence[Item]) -> list[str]:
    return [each.label for each in items]


def test_polling_is_one_question_with_its_times_even_among_other_messages() -> None:
    question = "rapp_get_robot_pose (7 times)"
    found = folded([WALK, *POSE * 3, ASKED, *POSE * 3, POSE[0], ASKED, POSE[1], STATE, *POSE])
    assert labels(found) == ["rapp_move_to", question, question, "moveTo", "moveTo", "s33 walk", *["rapp_get_robot_pose"] * 2]
    assert len(pairs(found)) == 2


def test_a_question_asked_a_few_times_is_shown_each_time() -> None:
    assert folded([*POSE * 3, STATE, *POSE * 3]) == [*POSE * 3, STATE, *POSE * 3]


def test_what_others_are_asked_for_is_no_polling() -> None:
    say = [
        message("call", "dynamic", "core", "rapp_say"), message("call", "core", "ALTextToSpeech", "say"),
        message("reply", "ALTextToSpeech", "core", "say"), message("reply", "core", "dynamic", "rapp_say"),
    ]  # fmt: skip
    assert [each for each in folded(say * 5) if each.text == "rapp_say"] == [say[0], say[3]] * 5


def test_different_answers_are_different() -> None:
    refused = message("reply", "core", "dynamic", "rapp_get_robot_pose: refused")
    assert len(folded([*POSE * 4, POSE[0], refused])) == 4
