import json
from typing import Any

import pytest

from rapp_bridge.access import Access, Gate
from rapp_bridge.effects import Close, Effect, Limits, Send
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
from rapp_bridge.session import Session
from rapp_bridge.websocket import POLICY

LIMITS = Limits(names=5, calls=2, fragments=1000, fragment_seconds=60)
TOKEN = "a-long-secret-token"


def resolve(name: str) -> str:
    return name if name.startswith("/") else f"/{name}"


@pytest.fixture
def session() -> Session:
    return Session(LIMITS, Gate(), resolve)


@pytest.fixture
def guarded() -> Session:
    """A session whose client has to show who it is; it may use /mine."""
    return Session(LIMITS, Gate({TOKEN: Access("it", ("/mine",), ("/mine",), ())}, lambda: 0.0), resolve)


def receive(session: Session, **fields: Any) -> list[Effect]:
    return session.receive(json.dumps(fields), 0.0)


def text(effect: Effect) -> dict[str, Any]:
    assert isinstance(effect, Send)
    data = b"".join(effect.frame)
    read: dict[str, Any] = json.loads(data[data.index(b"{") :])
    return read


def sent(effects: list[Effect]) -> dict[str, Any]:
    (effect,) = effects
    return text(effect)


@pytest.mark.parametrize(
    "frame", ["", "[]", '{"op":"dance","id":"i"}', '{"op":"publish","topic":"/x"}{"op":"publish","topic":"/x"}', b"\x00"]
)
def test_a_bad_frame_gives_a_status_and_nothing_else(session: Session, frame: str | bytes) -> None:
    status = sent(session.receive(frame, 0.0))
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
    assert receive(session, op="unsubscribe", topic="/x", id="2") == [Subscribe("/x", None, "1", 100, 3, again=True)]
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
    assert sent(session.answered(one, [b'{"ok":true}'])) == {
        "op": "service_response", "service": "/s", "id": 1, "result": True, "values": {"ok": True},
    }  # fmt: skip
    assert sent(session.failed(two, Unreachable("cannot: gone")))["values"] == "cannot: gone"
    assert receive(session, op="call_service", service="/s", id=4) == [CallService("/s", {}, 4)]


def test_messages_and_answers_pass_through(session: Session) -> None:
    assert receive(session, op="publish", topic="/x", msg={"a": 1}) == [Publish("/x", {"a": 1})]
    answer = receive(session, op="service_response", service="/s", id="1", result=True, values={})
    assert answer == [ServiceResponse("/s", "1", True, {})]


def test_the_most_demanding_compression_and_the_smallest_fragments_win(session: Session) -> None:
    receive(session, op="subscribe", topic="/x", id="1", compression="png", fragment_size=500)
    assert receive(session, op="subscribe", topic="/x", id="2", compression="cbor", fragment_size=900) == [
        Subscribe("/x", None, "2", 0, 0, 500, "cbor")
    ]
    assert receive(session, op="unsubscribe", topic="/x", id="2") == [Subscribe("/x", None, "1", 0, 0, 500, "png", again=True)]


def test_a_repeated_subscription_is_known_as_such(session: Session) -> None:
    receive(session, op="subscribe", topic="/x", id="1")
    assert receive(session, op="subscribe", topic="/x", id="1", throttle_rate=9) == [Subscribe("/x", None, "1", 9, again=True)]
    assert receive(session, op="subscribe", topic="/x", id="2") == [Subscribe("/x", None, "2", 0)]


@pytest.mark.parametrize("fields", [{"args": "x"}, {"timeout": "1"}, {"fragment_size": 0}, {"service": "no name"}])
def test_a_call_that_is_off_is_answered_for_its_caller_waits(session: Session, fields: dict[str, Any]) -> None:
    answer = sent(receive(session, **{"op": "call_service", "service": "/s", "id": "c", **fields}))
    assert (answer["op"], answer["id"], answer["result"]) == ("service_response", "c", False)
    assert answer["values"].startswith("cannot serve")


def test_fragments_make_a_message_in_any_order(session: Session) -> None:
    whole = json.dumps({"op": "publish", "topic": "/x", "msg": {"data": "€"}})
    parts = [whole[:20], whole[20:21], whole[21:]]
    for number in (2, 0):
        assert receive(session, op="fragment", id="f", num=number, total=3, data=parts[number]) == []
    assert receive(session, op="fragment", id="f", num=1, total=3, data=parts[1]) == [Publish("/x", {"data": "€"})]


@pytest.mark.parametrize("inner", ['{"op":"fragment","id":1,"num":0,"total":1,"data":""}', "{", '{"op":"dance"}'])
def test_fragments_of_a_bad_message_are_told(session: Session, inner: str) -> None:
    assert sent(receive(session, op="fragment", id="f", num=0, total=1, data=inner))["id"] == "f"
    assert session.close() == []


def test_statuses_are_sent_from_the_level_that_is_set(session: Session) -> None:
    assert session.tell("warning", "w") == []
    assert receive(session, op="set_level", level="info") == []
    assert sent(session.tell("info", "i")) == {"op": "status", "level": "info", "msg": "i"}
    receive(session, op="set_level", level="none")
    assert receive(session, op="dance") == []
    assert sent(receive(session, op="call_service", service="/s", args=3))["result"] is False


FIRST = [
    '{"op":"publish","topic":"/mine","msg":{}}',
    '{"op":"call_service","service":"/mine","id":"c"}',
    '{"op":"auth","mac":"00","client":"c","dest":"d","rand":"r","t":0,"level":"l","end":9}',
    '{"op":"auth","token":"wrong"}',
    '{"op":"auth","token":["a-long-secret-token"]}',
    '{"op":"auth","token":"a-long-secret-token"}{"op":"publish","topic":"/mine","msg":{}}',
    '{"op":"publish","topic":"/mine","msg":{}}{"op":"auth","token":"a-long-secret-token"}',
    '{"op":"auth","token":"a-long-secret-to',
    '{"op":"fragment","id":"f","num":0,"total":1,"data":"{}"}',
    '{"op":"dance"}',
    "",
    b"\xff",
    b"\xa1\x62op",
]


@pytest.mark.parametrize("frame", FIRST)
def test_a_first_frame_that_does_not_authenticate_ends_the_session_and_is_not_carried_out(
    guarded: Session, frame: str | bytes
) -> None:
    told, end = guarded.receive(frame, 0.0)
    assert text(told)["op"] == "status"
    assert isinstance(end, Close)
    assert end.code == POLICY
    assert guarded.receive(json.dumps({"op": "auth", "token": TOKEN}), 0.0) == []
    assert receive(guarded, op="publish", topic="/mine", msg={}) == []
    assert guarded.access is None
    assert guarded.close() == []


def test_an_authenticated_client_may_use_what_its_token_opens(guarded: Session) -> None:
    assert receive(guarded, op="auth", token=TOKEN) == []
    assert receive(guarded, op="subscribe", topic="mine") == [Subscribe("mine")]
    assert receive(guarded, op="call_service", service="/mine") == [CallService("/mine", {})]
    assert receive(guarded, op="publish", topic="/mine", msg={}) == [Publish("/mine", {})]
    assert receive(guarded, op="advertise_service", service="mine", type="a/B") == [AdvertiseService("mine", "a/B")]


@pytest.mark.parametrize(
    "fields",
    [
        {"op": "subscribe", "topic": "/other"},
        {"op": "subscribe", "topic": "other"},
        {"op": "advertise", "topic": "/other", "type": "a/B"},
        {"op": "publish", "topic": "/other", "msg": {}},
        {"op": "advertise_service", "service": "/other", "type": "a/B"},
    ],
)
def test_what_a_token_does_not_open_is_refused_and_told(guarded: Session, fields: dict[str, Any]) -> None:
    receive(guarded, op="auth", token=TOKEN)
    assert "it may not" in sent(receive(guarded, **fields, id="i"))["msg"]
    assert guarded.close() == []


def test_a_refused_call_is_answered(guarded: Session) -> None:
    receive(guarded, op="auth", token=TOKEN)
    answer = sent(receive(guarded, op="call_service", service="/other#7"))
    assert (answer["id"], answer["result"], answer["service"]) == ("7", False, "/other#7")
    assert "it may not" in answer["values"]


def test_a_client_that_has_shown_its_token_before_need_not_again() -> None:
    session = Session(LIMITS, Gate({TOKEN: Access("it")}, lambda: 0.0), resolve, Access("it", ("/mine",), (), ()))
    assert receive(session, op="subscribe", topic="/mine") == [Subscribe("/mine")]
    assert "it may not" in sent(receive(session, op="subscribe", topic="/other"))["msg"]


def test_what_is_off_in_a_message_of_fragments_is_told_as_if_it_had_come_whole(session: Session) -> None:
    inner = json.dumps({"op": "call_service", "service": "/s", "id": "call", "args": "x"})
    assert receive(session, op="fragment", id="f", num=0, total=2, data=inner[:9]) == []
    answer = sent(receive(session, op="fragment", id="f", num=1, total=2, data=inner[9:]))
    assert (answer["op"], answer["id"], answer["result"]) == ("service_response", "call", False)
    assert "field args is str" in answer["values"]
    assert sent(receive(session, op="fragment", id="f", num=0, total=1, data="{"))["id"] == "f"
