from typing import Any

import pytest

from rapp_core.control.telling import Telling
from rapp_core.trace import Trace


def told(name: str, arguments: dict[str, Any], result: Any) -> list[str]:
    details: list[str] = []
    trace = Trace()
    trace.listen(lambda happening: details.append(happening.detail))
    telling = Telling(trace, name, arguments)
    telling.asked()
    telling.progress("on the way")
    assert telling.answered(result) is result
    telling.failed("unreachable")
    return details


@pytest.mark.parametrize(
    ("name", "arguments", "result", "call", "answer"),
    [
        ("register", {}, {"registered": True}, "register", "register"),
        ("interpret", {}, {"rapp": "clock"}, "interpret", "interpret: clock"),
        ("install", {"name": "clock"}, {"path": "/x"}, "install clock", "install clock"),
        ("call", {"service": "profile", "arguments": {}}, [1], "call profile", "call profile"),
        ("send_mail", {}, {"state": "kept"}, "send_mail", "send_mail: kept"),
        ("send_mail", {}, "no object", "send_mail", "send_mail"),
    ],
)
def test_a_request_its_progress_and_its_end_are_told(
    name: str, arguments: dict[str, Any], result: Any, call: str, answer: str
) -> None:
    assert told(name, arguments, result) == [
        f"core->link {call}",
        "link->core on the way (asynchronous)",
        f"link->core reply {answer}",
        f"link->core reply {call}: unreachable",
    ]


def test_what_is_asked_every_minute_is_not_told() -> None:
    assert told("list_rapps", {}, {"rapps": []}) == []


def test_a_request_that_is_given_up_is_told_as_cancelled() -> None:
    details: list[str] = []
    trace = Trace()
    trace.listen(lambda happening: details.append(happening.detail))
    for name in ("install", "list_rapps"):
        Telling(trace, name, {"name": "clock"}).cut()
    assert details == ["core->link cancel install clock (asynchronous)"]
