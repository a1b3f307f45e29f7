"""What the link tells of its messages; the platform is a client whose wire is replaced."""

import asyncio
from collections.abc import Sequence
from typing import Any

import pytest

from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Refused, Unreachable
from rapp_link.letter import Outcome
from rapp_link.smtp import Locked
from rapp_link.telling import TellingClient, TellingSender, untold


def answering(monkeypatch: pytest.MonkeyPatch, answer: Any) -> tuple[TellingClient, list[str]]:
    async def wire(*_: Any, **__: Any) -> Any:
        if isinstance(answer, Exception):
            raise answer
        return answer

    for method in ("call", "download"):
        monkeypatch.setattr(HopClient, method, wire)
    told: list[str] = []
    return TellingClient("http://127.0.0.1:1", None, told.append), told


def test_a_call_and_its_reply_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    client, told = answering(monkeypatch, {"name": "Maria"})
    assert asyncio.run(client.call("profile", {})) == {"name": "Maria"}
    assert told == ["link->repository profile", "repository->link reply profile"]


def test_a_call_of_a_cloud_agent_is_told_without_its_address(monkeypatch: pytest.MonkeyPatch) -> None:
    client, told = answering(monkeypatch, {})
    asyncio.run(client.call("agents/secret/check", {}))
    assert told == ["link->cloud-agent check", "cloud-agent->link reply check"]


def test_a_file_is_told_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    client, told = answering(monkeypatch, 12)
    assert (
        asyncio.run(client.download(f"http://127.0.0.1:1/tuf/targets/{'0f' * 32}.clock-1.0.0.hz?a=b", bytearray().extend, 20)) == 12
    )
    assert told == ["link->repository GET clock-1.0.0.hz", "repository->link reply GET clock-1.0.0.hz"]


@pytest.mark.parametrize(
    ("error", "end"),
    [
        (Refused("cannot: no", 404), "repository->link reply profile: 404"),
        (Unreachable("cannot reach it"), "link: no answer to profile"),
    ],
)
def test_an_answer_that_never_came_is_not_told_as_a_message(monkeypatch: pytest.MonkeyPatch, error: HopError, end: str) -> None:
    client, told = answering(monkeypatch, error)
    with pytest.raises(type(error)):
        asyncio.run(client.call("profile"))
    assert told == ["link->repository profile", end]


@pytest.mark.parametrize("service", ["heartbeat", "list_rapps", "list_cloud_agents"])
def test_what_is_asked_again_and_again_is_not_told(monkeypatch: pytest.MonkeyPatch, service: str) -> None:
    client, told = answering(monkeypatch, {})
    asyncio.run(client.call(service))
    assert told == []


def test_a_look_at_the_store_that_comes_again_and_again_is_not_told_and_what_follows_is(monkeypatch: pytest.MonkeyPatch) -> None:
    client, told = answering(monkeypatch, 12)

    async def looks() -> None:
        loop = asyncio.get_running_loop()
        get = client.download("http://127.0.0.1:1/tuf/metadata/timestamp.json", bytearray().extend, 20)
        with untold():
            await asyncio.to_thread(lambda: asyncio.run_coroutine_threadsafe(get, loop).result())
        assert told == []
        await client.download("http://127.0.0.1:1/tuf/metadata/timestamp.json", bytearray().extend, 20)

    asyncio.run(looks())
    assert told == ["link->repository GET timestamp.json", "repository->link reply GET timestamp.json"]


class Server:
    def __init__(self, outcome: Outcome | HopError) -> None:
        self.outcome = outcome

    async def send(self, _sender: str, _recipients: Sequence[str], _content: bytes) -> Outcome:
        if isinstance(self.outcome, HopError):
            raise self.outcome
        return self.outcome


@pytest.mark.parametrize(
    ("outcome", "end"),
    [
        (Outcome(("a@x",)), "mail-server->link reply mail (SMTP): taken"),
        (Outcome(("a@x",), {"b@x": "550 no"}), "mail-server->link reply mail (SMTP): taken, refused"),
        (Outcome(later={"a@x": "450 busy"}), "mail-server->link reply mail (SMTP): later"),
        (Locked("cannot log in"), "link: the mail is not taken (unreachable)"),
    ],
)
def test_a_mail_and_what_the_server_says_are_told(outcome: Outcome | HopError, end: str) -> None:
    told: list[str] = []
    sending = TellingSender(Server(outcome), told.append).send("nao@x", ["a@x"], b"")
    if isinstance(outcome, HopError):
        with pytest.raises(type(outcome)):
            asyncio.run(sending)
    else:
        assert asyncio.run(sending) is outcome
    assert told == ["link->mail-server mail (SMTP)", end]
