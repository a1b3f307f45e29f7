import itertools

import pytest

from rapp_bridge.errors import Invalid, Refused
from rapp_bridge.fragments import Fragments
from rapp_bridge.protocol import Fragment


@pytest.fixture
def fragments() -> Fragments:
    return Fragments(limit=1000, seconds=60, count=3)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_parts_are_put_together_in_any_order(fragments: Fragments, order: tuple[int, ...]) -> None:
    results = [fragments.take(Fragment("i", number, 3, "abc"[number]), 0) for number in order]
    assert results == [None, None, "abc"]


def test_two_messages_do_not_mix_and_a_part_may_come_twice(fragments: Fragments) -> None:
    assert fragments.take(Fragment("a", 0, 2, "x"), 0) is None
    assert fragments.take(Fragment(1, 1, 2, "B"), 0) is None
    assert fragments.take(Fragment("a", 0, 2, "x"), 0) is None
    assert fragments.take(Fragment("a", 1, 2, "y"), 0) == "xy"
    assert fragments.take(Fragment(1, 0, 2, "A"), 0) == "AB"


@pytest.mark.parametrize(
    "part", [Fragment("i", -1, 2, ""), Fragment("i", 2, 2, ""), Fragment("i", 0, 0, ""), Fragment("i", 0, 10**9, "")]
)
def test_numbers_that_cannot_be_are_refused(fragments: Fragments, part: Fragment) -> None:
    with pytest.raises(Invalid, match="they count from 0"):
        fragments.take(part, 0)


@pytest.mark.parametrize("second", [Fragment("i", 1, 3, "y"), Fragment("i", 0, 2, "other")])
def test_parts_that_contradict_each_other_forget_the_message(fragments: Fragments, second: Fragment) -> None:
    fragments.take(Fragment("i", 0, 2, "x"), 0)
    with pytest.raises(Invalid, match="contradicts"):
        fragments.take(second, 0)
    assert fragments.take(Fragment("i", 1, 2, "y"), 0) is None
    assert fragments.take(Fragment("i", 0, 2, "x"), 0) == "xy"


def test_unfinished_messages_are_few_and_of_bounded_size(fragments: Fragments) -> None:
    for name in "abc":
        fragments.take(Fragment(name, 0, 2, "x" * 300), 0)
    with pytest.raises(Refused, match="more than 3 unfinished"):
        fragments.take(Fragment("d", 0, 2, "x"), 0)
    with pytest.raises(Refused, match="more than 1000 characters"):
        fragments.take(Fragment("b", 1, 2, "x" * 300), 0)
    assert fragments.take(Fragment("a", 1, 2, "y"), 0) == "x" * 300 + "y"


def test_an_unfinished_message_is_forgotten_after_a_while(fragments: Fragments) -> None:
    fragments.take(Fragment("i", 0, 2, "old"), 0)
    assert fragments.take(Fragment("i", 1, 2, "new"), 61) is None
