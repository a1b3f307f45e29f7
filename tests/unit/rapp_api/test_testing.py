"""The core agent for authors' tests refuses what the real one refuses."""

import json
from pathlib import Path

import pytest

from rapp_api import Bug, Invalid, Refused, Unreachable, cloud, communication
from rapp_api.core_agent import current
from rapp_api.testing import FakeCoreAgent


def test_it_answers_as_its_person_and_its_services_do() -> None:
    services = {"add": lambda arguments: arguments["a"] + arguments["b"], "away": Unreachable("cannot reach it")}
    with FakeCoreAgent(hears=["yes", "perhaps"], services=services) as core:
        assert communication.word_spotting(["Yes", "No"]) == "Yes"
        assert communication.word_spotting(["Yes", "No"]) == communication.EMPTY
        assert communication.word_spotting(["Yes", "No"]) == communication.EMPTY
        assert cloud.call_wait("add", {"a": 1, "b": 2}) == 3
        with pytest.raises(Unreachable):
            cloud.call_wait("away")
        with pytest.raises(Refused):
            cloud.call_wait("unknown")
        assert core.said() == []


def test_it_has_the_limits_of_the_real_one() -> None:
    with FakeCoreAgent():
        for wrong in (
            lambda: communication.word_spotting([]),
            lambda: communication.word_spotting(["a"] * 101),
            lambda: communication.capture_audio(0),
            lambda: communication.capture_audio(301),
            lambda: communication.capture_audio_until_silence("../x.ogg"),
            lambda: communication.play_audio("nobody/recorded/this.ogg"),
            lambda: communication.play_audio(communication.capture_audio(1), volume=2.0),
            lambda: cloud.call_wait("x", {"x": float("nan")}),
        ):
            with pytest.raises(Invalid):
                wrong()
        with pytest.raises(Refused):
            cloud.send_mail_wait(["a@b.example"], "s", "b", "/etc/passwd")


def test_with_a_package_it_refuses_what_package_json_does_not_name(tmp_path: Path) -> None:
    rapp = {"permissions": {"core": ["rapp_say"], "cloud": ["profile"]}, "parameters": {"n": 1}}
    (tmp_path / "package.json").write_text(json.dumps({"name": "x", "rapp": rapp}))
    with FakeCoreAgent(services={"profile": 1, "other": 2}, package=tmp_path) as core:
        communication.rapp_say("hello")
        assert (core.parameters, cloud.call_wait("profile")) == ({"n": 1}, 1)
        for refused in (
            lambda: communication.rapp_record(1.0),
            lambda: cloud.call_wait("other"),
            lambda: cloud.send_mail_wait([], "", ""),
        ):
            with pytest.raises(Refused, match=r"package\.json"):
                refused()


def test_it_is_the_core_agent_only_within_its_block() -> None:
    with FakeCoreAgent():
        current()
    with pytest.raises(Bug):
        current()
