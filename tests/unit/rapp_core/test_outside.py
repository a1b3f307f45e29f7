"""Calls of a dynamic agent that leave the robot: only those its package.json names, only its own recordings."""

import json
from pathlib import Path
from typing import Any

import pytest

from fakes.agents import FakeAgent, Script
from fakes.clock import Clock
from fakes.link import FakeLink
from fakes.rapps import write_rapp
from rapp_core.config import Config, Limits
from rapp_core.control.cloud_agent import CloudAgents
from rapp_core.errors import NOT_KNOWN, Invalid, Refused, Unreachable
from rapp_core.manifest import read_manifest
from rapp_core.services.outside import CloudCall, Outside
from rapp_core.services.sendable import CallFile


@pytest.fixture
def agent(tmp_path: Path) -> FakeAgent:
    permissions = {"core": [], "cloud": ["profile", "send_mail"]}
    package = write_rapp(tmp_path / "run" / "package", "mailer", permissions=permissions)
    (tmp_path / "run" / "recordings").mkdir()
    return FakeAgent(Clock(), tmp_path / "run", read_manifest(package), Script(), [], lambda _message: None)


@pytest.fixture
def link() -> FakeLink:
    link = FakeLink()
    link.answers = {"call": {"name": "Maria"}, "send_mail": {"state": "kept", "message_id": "<1>"}}
    return link


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def outside(link: FakeLink, clock: Clock, tmp_path: Path) -> Outside:
    config = Config(name="nao7", home=tmp_path / "home")
    return Outside(link, CloudAgents(link, config), config, clock.event(), clock.now)


def test_a_permitted_call_is_passed_on_and_answered(outside: Outside, agent: FakeAgent, link: FakeLink) -> None:
    assert outside.cloud_call(agent, CloudCall("profile", '{"robot": "nao7"}', 2.0)) == '{"name": "Maria"}'
    assert link.asked == [("call", {"service": "profile", "arguments": {"robot": "nao7"}})]


@pytest.mark.parametrize("service", ["report", "Profile", ""])
def test_a_call_that_the_package_does_not_name_is_refused(outside: Outside, agent: FakeAgent, link: FakeLink, service: str) -> None:
    with pytest.raises(Refused, match=r"permissions\.cloud"):
        outside.cloud_call(agent, CloudCall(service, "{}"))
    assert link.asked == []


@pytest.mark.parametrize("arguments", ["{", "[1]", '"text"'])
def test_arguments_that_are_no_object_are_invalid(outside: Outside, agent: FakeAgent, arguments: str) -> None:
    with pytest.raises(Invalid):
        outside.cloud_call(agent, CloudCall("profile", arguments))


def test_a_mail_is_handed_to_the_link(outside: Outside, agent: FakeAgent, link: FakeLink) -> None:
    recording = agent.recordings / "recording-1.ogg"
    recording.write_bytes(b"OggS")
    assert outside.send_mail(agent, ["e@home.example"], "subject", "body", str(recording)) == "kept"
    assert link.asked[0][1]["attachment"] == str(recording)


def test_every_mail_has_an_id_of_its_own(outside: Outside, agent: FakeAgent, link: FakeLink) -> None:
    for _ in range(3):
        outside.send_mail(agent, ["e@home.example"], "subject", "body", "")
    identities = [arguments["message_id"] for _, arguments in link.asked]
    assert len(set(identities)) == 3
    assert all(each.startswith("<") and each.endswith(".rapp>") for each in identities)


def test_only_recordings_of_the_run_leave_the_robot(outside: Outside, agent: FakeAgent, tmp_path: Path, link: FakeLink) -> None:
    secret = tmp_path / "secret.ogg"
    secret.write_bytes(b"OggS")
    (agent.recordings / "link.ogg").symlink_to(secret)
    for path in (secret, agent.recordings / "link.ogg", agent.recordings / ".." / ".." / "secret.ogg"):
        with pytest.raises(Refused):
            outside.send_mail(agent, ["e@home.example"], "subject", "body", str(path))
    assert link.asked == []


def test_a_link_that_stays_away_is_told_after_a_bound(outside: Outside, agent: FakeAgent, link: FakeLink, clock: Clock) -> None:
    link.away = True
    with pytest.raises(Unreachable):
        outside.send_mail(agent, ["e@home.example"], "subject", "body", "")
    assert Config.link_back - 1.0 < clock.time <= Config.link_back


def test_of_a_link_that_was_lost_on_the_way_and_stays_away_it_is_not_known_what_it_does(
    outside: Outside, agent: FakeAgent, link: FakeLink, clock: Clock
) -> None:
    lost = Unreachable("cannot send_mail: the link was lost")
    lost.reason = NOT_KNOWN
    link.errors["send_mail"] = lost
    clock.at(1.0, lambda: setattr(link, "away", True))
    assert outside.send_mail(agent, ["e@home.example"], "subject", "body", "") == "unknown"
    assert Config.link_back - 1.0 < clock.time <= Config.link_back


def test_a_link_that_comes_back_is_given_the_same_mail_again(
    outside: Outside, agent: FakeAgent, link: FakeLink, clock: Clock
) -> None:
    link.away = True
    clock.at(5.0, lambda: setattr(link, "away", False))
    assert outside.send_mail(agent, ["e@home.example"], "subject", "body", "") == "kept"
    assert len(link.asked) > 1
    assert len({arguments["message_id"] for _, arguments in link.asked}) == 1


def test_nobody_waits_for_the_link_when_the_run_is_over(outside: Outside, agent: FakeAgent, link: FakeLink, clock: Clock) -> None:
    link.away, agent.alive = True, False
    with pytest.raises(Unreachable):
        outside.send_mail(agent, ["e@home.example"], "subject", "body", "")
    assert clock.time == 0.0


def test_a_mail_that_is_refused_is_not_tried_again(outside: Outside, agent: FakeAgent, link: FakeLink) -> None:
    link.errors["send_mail"] = Refused("cannot deliver to e@home.example: 550")
    with pytest.raises(Refused):
        outside.send_mail(agent, ["e@home.example"], "subject", "body", "")
    assert link.names().count("send_mail") == 1


def test_the_link_hears_that_its_refusal_has_come_and_one_that_does_not_is_no_trouble(
    outside: Outside, agent: FakeAgent, link: FakeLink
) -> None:
    link.errors["send_mail"] = Refused("cannot deliver to e@home.example: 550")
    link.errors["mail_told"] = Unreachable("away")
    with pytest.raises(Refused, match="550"):
        outside.send_mail(agent, ["e@home.example"], "subject", "body", "")
    (_, told), (name, noted) = link.asked
    assert (name, noted) == ("mail_told", {"message_id": told["message_id"], "recipients": ["e@home.example"], "late": False})


def test_a_refusal_that_finds_its_run_over_is_left_to_be_told_later(outside: Outside, agent: FakeAgent, link: FakeLink) -> None:
    agent.alive = False
    link.errors["send_mail"] = Refused("cannot deliver to e@home.example: 550")
    with pytest.raises(Refused):
        outside.send_mail(agent, ["e@home.example"], "subject", "body", "")
    assert link.names() == ["send_mail"]


def sent(link: FakeLink) -> list[dict[str, Any]]:
    return [arguments["arguments"] for name, arguments in link.asked if name == "call"]


def test_a_recording_or_a_kept_file_may_be_sent(outside: Outside, agent: FakeAgent, link: FakeLink, tmp_path: Path) -> None:
    for path in (agent.recordings / "recording-1.ogg", tmp_path / "home" / "keepsakes" / "mailer" / "table.jpg"):
        outside.cloud_call(agent, CloudCall("profile", json.dumps({"recording": {"file": str(path)}})))
        assert sent(link)[-1] == {"recording": {"file": str(path)}}


def test_no_other_file_leaves_the_robot(outside: Outside, agent: FakeAgent, link: FakeLink, tmp_path: Path) -> None:
    secret = tmp_path / "secret.ogg"
    secret.write_bytes(b"OggS")
    (agent.recordings / "link.ogg").symlink_to(secret)
    others = tmp_path / "home" / "keepsakes" / "other" / "table.jpg"
    for path in (secret, agent.recordings / "link.ogg", agent.recordings / ".." / ".." / "secret.ogg", others, "recording.ogg", 3):
        with pytest.raises(Refused, match="may leave the robot"):
            outside.cloud_call(agent, CloudCall("profile", json.dumps({"recording": {"file": str(path)}})))
    assert link.asked == []


def test_files_handed_over_lie_on_the_disk_while_the_call_runs(outside: Outside, agent: FakeAgent, link: FakeLink) -> None:
    seen: list[bytes] = []

    def look(arguments: dict[str, Any]) -> str:
        path = Path(arguments["arguments"]["picture"]["file"])
        seen.append(path.read_bytes())
        assert path.parent == agent.recordings and path.suffix == ".jpg"
        return "ok"

    link.answers["call"] = look
    assert outside.cloud_call(agent, CloudCall("profile", "{}", files=[CallFile("picture", "a/../b.JPG", b"JPEG")])) == '"ok"'
    assert seen == [b"JPEG"]
    assert list(agent.recordings.iterdir()) == []
    link.errors["call"] = Unreachable("cannot reach it")
    with pytest.raises(Unreachable):
        outside.cloud_call(agent, CloudCall("profile", "{}", files=[CallFile("picture", "b.jpg", b"JPEG")]))
    assert list(agent.recordings.iterdir()) == []


def test_files_are_bounded(outside: Outside, agent: FakeAgent, link: FakeLink) -> None:
    half = bytes(Limits().sent // 2 + 1)
    with pytest.raises(Refused, match="bytes with a call"):
        outside.cloud_call(agent, CloudCall("profile", "{}", files=[CallFile("a", "a", half), CallFile("b", "b", half)]))
    with pytest.raises(Invalid, match="twice"):
        outside.cloud_call(agent, CloudCall("profile", "{}", files=[CallFile("a", "a", b""), CallFile("a", "b", b"")]))
    assert link.asked == []


def test_without_a_partner_there_is_no_cloud_agent_to_call(outside: Outside, agent: FakeAgent, link: FakeLink) -> None:
    with pytest.raises(Refused, match="names no partner"):
        outside.cloud_call(agent, CloudCall("check", "{}", agent=True))
    assert not outside.stop_cloud_agent(agent)
    assert link.asked == []
