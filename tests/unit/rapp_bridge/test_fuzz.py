"""Frames of clients changed at random: a session answers, or carries out, and never breaks."""

from typing import Any

import pytest

from fakes.bridge_fuzz import SEEDS, Fuzz, new_seed
from rapp_bridge.access import Access, Gate
from rapp_bridge.cbor import read
from rapp_bridge.effects import Close, Limits, Send
from rapp_bridge.encoding import encode, encode_arguments
from rapp_bridge.errors import BridgeError
from rapp_bridge.incoming import parse
from rapp_bridge.protocol import CallService, Publish
from rapp_bridge.rostypes import message_class, service_class
from rapp_bridge.session import Session

FRAMES = 4000
TYPES = {"/fuzz_scan": "sensor_msgs/LaserScan", "/fuzz_image": "sensor_msgs/Image"}
LIMITS = Limits(names=50, calls=20, fragments=5000, fragment_seconds=60)


def carry_out(session: Session, effect: Any) -> None:
    """As far as it can be without ROS: fill the message that is sent, with an error when it does not fit."""
    try:
        if isinstance(effect, Publish):
            encode(effect.msg, message_class(TYPES.get(effect.topic, "std_msgs/String")))
        elif isinstance(effect, CallService):
            encode_arguments(effect.args, service_class("rapp_msgs/Say")._request_class)
            session.answered(effect, [b"{}"])
    except BridgeError as error:
        assert all(isinstance(each, Send) for each in session.failed(effect, error))


@pytest.mark.parametrize("seed", [*SEEDS, new_seed()], ids=str)
def test_a_session_survives_any_frame(seed: int) -> None:
    fuzz, session = Fuzz(seed), Session(LIMITS, Gate(), lambda name: name)
    for number in range(FRAMES):
        frame, _ = fuzz.frame()
        for effect in session.receive(frame, number / 100):
            assert not isinstance(effect, Close)
            if not isinstance(effect, Send):
                carry_out(session, effect)
    session.close()


@pytest.mark.parametrize("seed", [*SEEDS, new_seed()], ids=str)
def test_no_frame_but_a_good_auth_opens_a_guarded_session(seed: int) -> None:
    fuzz, gate = Fuzz(seed), Gate({"a-long-secret-token": Access("it")}, lambda: 0.0)
    for _ in range(FRAMES // 2):
        session = Session(LIMITS, gate, lambda name: name)
        effects = session.receive(fuzz.frame()[0], 0.0)
        assert [type(effect) for effect in effects] == [Send, Close]
        assert session.receive('{"op":"publish","topic":"/x","msg":{}}', 0.0) == []


@pytest.mark.parametrize("seed", [*SEEDS, new_seed()], ids=str)
def test_what_can_be_read_as_cbor_is_read_or_refused(seed: int) -> None:
    fuzz = Fuzz(seed)
    for _ in range(FRAMES):
        frame, _ = fuzz.frame()
        for reader in (parse, read):
            try:
                reader(frame)
            except BridgeError as error:
                assert len(str(error)) < 5000
