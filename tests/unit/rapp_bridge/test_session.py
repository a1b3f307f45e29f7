import json
from typing import Any

import pytest

from rapp_bridge.errors import Invalid, Unreachable
from rapp_bridge.protocol import (
    Advertise,
    AdvertiseService,
    CallService,
    Publish,
    ServiceResponse,
    Subscribe,
    Unadvertise,
    UnadvertiseService,
    Unsubscribe,
)
from rapp_bridge.session import Effect, Send, Session


@pytest.fixture
def session() -> Session:
    return Session(names=5, calls=2)


def receive(session: Session, **fields: Any) -> list[Effect]:
    return session.receive(json.dumps(fields))


def sent(effects: list[Effect]) -> dict[str, Any]:
    (effect,) = effects
    assert isinstance(effect, Send)
    read: dict[str, Any] = json.loads(effect.frame)
    return read


@pytest.mark.parametrize(
    "frame", ["", "[]", '{"op":"dance","id":"i"}', '{"op":"publish","topic":"/x"}{"op":"publish","topic":"/x"}', b"\x00"]
)
def test_a_bad_frame_gives_a_status_and_nothing_else(session: Session, frame: str | bytes) -> None:
    status = sent(session.receive(frame))
    assert (status["op"], status["level"]) == ("status", "error")
    assert session.close() == []


def test_a_status_carries_the_id_of_the_bad_frame(session: Session) -> None:
    assert sent(receive(session, op="dance", id="i"))["id"] == "i"


def test_several_ids_are_one_subscription_with_the_most_demanding_settings(session: Session) -> None:
    first = receive(session, op="subscribe", topic="/x", id="1", throttle_rate=100, queue_length=3)
    assert first == [Subscribe("/x", None, "1", 100, 3)]
    assert receive(session, op="subscribe", topic="/x", id="2", throttle_rate=20, queue_length=9) == [
        Subscribe("/x", None, "2", 20, 9)
    ]
    assert receive(session, op="unsubscribe", topic="/x", id="2") == [Subscribe("/x", None, "1", 100, 3)]
    assert receive(session, op="unsubscribe", topic="/x", id="1") == [Unsubscribe("/x", "1")]
    assert session.close() == []


def test_without_an_id_all_of_a_topic_ends(session: Session) -> None:
    for number in "12":
        receive(session, op="subscribe", topic="/x", id=number)
        receive(session, op="advertise", topic="/x", type="a/B", id=number)
    assert receive(session, op="unsubscribe", topic="/x") == [Unsubscribe("/x")]
    assert receive(session, op="unadvertise", topic="/x") == [Unadvertise("/x")]
    assert session.close() == []


def test_an_advertisement_ends_with_its_last_id(session: Session) -> None:
    receive(session, op="advertise", topic="/x", type="a/B", id="1")
    receive(session, op="advertise", topic="/x", type="a/B", id="2")
    assert receive(session, op="unadvertise", topic="/x", id="1") == []
    assert receive(session, op="unadvertise", topic="/x", id="2") == [Unadvertise("/x", "2")]


@pytest.mark.parametrize("op", ["unadvertise", "unsubscribe"])
def test_what_is_not_held_cannot_be_given_up(session: Session, op: str) -> None:
    assert sent(receive(session, op=op, topic="/x"))["msg"].startswith("cannot un")
    assert sent(receive(session, op="unadvertise_service", service="/s"))["msg"].startswith("cannot un")


def test_leaving_undoes_all_that_is_held_services_first(session: Session) -> None:
    receive(session, op="subscribe", topic="/in")
    receive(session, op="advertise", topic="/out", type="a/B")
    receive(session, op="publish", topic="/unannounced", msg={})
    receive(session, op="advertise_service", service="/s", type="a/B")
    assert session.close() == [UnadvertiseService("/s"), Unsubscribe("/in"), Unadvertise("/out"), Unadvertise("/unannounced")]
    assert session.close() == []


def test_a_failed_effect_is_told_and_not_held(session: Session) -> None:
    for fields in (
        {"op": "subscribe", "topic": "/x", "id": "i"},
        {"op": "advertise", "topic": "/x", "type": "a/B", "id": "i"},
        {"op": "advertise_service", "service": "/s", "type": "a/B"},
    ):
        (effect,) = receive(session, **fields)
        assert isinstance(effect, Subscribe | Advertise | AdvertiseService)
        assert sent(session.failed(effect, Invalid("cannot do it")))["msg"] == "cannot do it"
    assert session.close() == []


def test_a_failed_repetition_leaves_the_first_in_place(session: Session) -> None:
    receive(session, op="advertise", topic="/x", type="a/B")
    receive(session, op="subscribe", topic="/y", throttle_rate=5)
    (again,) = receive(session, op="advertise", topic="/x", type="c/D")
    assert isinstance(again, Advertise)
    session.failed(again, Invalid("cannot: another type"))
    (other,) = receive(session, op="subscribe", topic="/y", type="c/D", throttle_rate=1)
    assert isinstance(other, Subscribe)
    session.failed(other, Invalid("cannot: another type"))
    assert receive(session, op="subscribe", topic="/y", id="2", throttle_rate=9) == [Subscribe("/y", None, "2", 5, 0)]
    assert session.close() == [Unsubscribe("/y"), Unadvertise("/x")]


def test_a_client_holds_a_bounded_number_of_names(session: Session) -> None:
    for number in range(5):
        assert receive(session, op="subscribe", topic="/x", id=number) != []
    assert "cannot hold /y" in sent(receive(session, op="advertise", topic="/y", type="a/B"))["msg"]
    assert isinstance(receive(session, op="subscribe", topic="/x", id=4)[0], Subscribe)
    receive(session, op="unsubscribe", topic="/x", id=0)
    assert isinstance(receive(session, op="advertise", topic="/y", type="a/B")[0], Advertise)


def test_calls_are_bounded_and_each_gets_one_answer(session: Session) -> None:
    (one,), (two,) = (receive(session, op="call_service", service="/s", id=i) for i in (1, 2))
    assert isinstance(one, CallService)
    assert isinstance(two, CallService)
    refused = sent(receive(session, op="call_service", service="/s", id=3))
    assert (refused["id"], refused["result"]) == (3, False)
    assert sent(session.answered(one, {"ok": True})) == {
        "op": "service_response", "service": "/s", "id": 1, "result": True, "values": {"ok": True},
    }  # fmt: skip
    assert sent(session.failed(two, Unreachable("cannot: gone")))["values"] == "cannot: gone"
    assert receive(session, op="call_service", service="/s", id=4) == [CallService("/s", {}, 4)]


def test_messages_and_answers_pass_through(session: Session) -> None:
    assert receive(session, op="publish", topic="/x", msg={"a": 1}) == [Publish("/x", {"a": 1})]
    answer = receive(session, op="service_response", service="/s", id="1", result=True, values={})
    assert answer == [ServiceResponse("/s", "1", True, {})]
