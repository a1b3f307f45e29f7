"""Services that clients offer."""

import asyncio
from typing import Any

import pytest

from fakes.bridge_neighbours import PATIENCE, Clients, Peer, Socket


async def offer(clients: Clients, name: str, kind: str = "rapp_msgs/Say") -> Socket:
    provider = await clients.new()
    await provider.send(op="advertise_service", service=name, type=kind)
    await provider.settle()
    return provider


async def reply(provider: Socket, request: dict[str, Any], text: str) -> None:
    values = {"success": True, "message": text}
    await provider.send(op="service_response", service=request["service"], id=request["id"], result=True, values=values)


def test_fifty_callers_at_once_are_answered_in_any_order(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            provider = await offer(clients, "/crowded")
            for number in range(50):
                peer.call("/crowded", f"n{number}")
            requests = [await provider.receive("call_service") for _ in range(50)]
            assert len({request["id"] for request in requests}) == 50
            for request in reversed(requests):
                await reply(provider, request, request["args"]["text"])
            assert {await peer.heard() for _ in range(50)} == {f"n{number}" for number in range(50)}

    asyncio.run(story())


def test_callers_of_a_provider_that_leaves_are_told_at_once(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            provider, other = await offer(clients, "/leaving"), await clients.new()
            peer.call("/leaving", "from ROS")
            await other.send(op="call_service", service="/leaving", args=["from a client"], timeout=3600)
            for _ in range(2):
                await provider.receive("call_service")
            provider.leave()
            answer = await other.receive("service_response")
            assert (answer["result"], "its provider has left" in answer["values"]) == (False, True)
            assert "its provider has left" in await peer.heard()
            async with asyncio.timeout(PATIENCE):  # until the bridge has taken it off the master
                while "no such service" not in (gone := await other.call("/leaving"))["values"]:
                    assert gone["result"] is False

    asyncio.run(story())


def test_a_service_offered_anew_serves_the_connections_of_before(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            for turn in ("first", "second"):
                provider = await offer(clients, "/again_kept")
                peer.call("/again_kept", turn)
                request = await provider.receive("call_service")
                assert request["args"]["text"] == turn
                await reply(provider, request, f"{turn} answer")
                assert await peer.heard() == f"{turn} answer"
                await provider.send(op="unadvertise_service", service="/again_kept")
                await provider.settle()

    asyncio.run(story())


def test_who_offers_a_name_again_takes_it_over(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            first = await offer(clients, "/taken")
            peer.call("/taken", "for the first")
            await first.receive("call_service")
            second = await offer(clients, "/taken")
            assert "its provider has left" in await peer.heard()
            await first.send(op="unadvertise_service", service="/taken")
            await first.settle()
            peer.call("/taken", "for the second")
            await reply(second, await second.receive("call_service"), "mine")
            assert await peer.heard() == "mine"

    asyncio.run(story())


@pytest.mark.parametrize(
    ("result", "values", "heard"),
    [
        (False, None, "the provider failed"),
        (False, "no voice", "no voice"),
        (False, {"success": False, "message": "still an answer"}, "still an answer"),
        (True, {"volume": 1}, "it has no field volume"),
        (True, {"success": 1}, "a bool is needed"),
        (True, [], "an object is needed"),
    ],
)
def test_an_answer_that_is_off_is_an_error_of_the_call(clients: Clients, peer: Peer, result: bool, values: Any, heard: str) -> None:
    async def story() -> str:
        async with clients:
            provider = await offer(clients, "/failing")
            peer.call("/failing", "x")
            request = await provider.receive("call_service")
            await provider.send(op="service_response", service="/failing", id=request["id"], result=result, values=values)
            return await peer.heard()

    assert heard in asyncio.run(story())


def test_answers_of_others_are_refused(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            provider, thief = await offer(clients, "/guarded"), await clients.new()
            peer.call("/guarded", "x")
            request = await provider.receive("call_service")
            await reply(thief, request, "stolen")
            assert "nobody waits" in (await thief.receive("status"))["msg"]
            await reply(provider, request, "genuine")
            assert await peer.heard() == "genuine"
            await reply(provider, request, "twice")
            assert "nobody waits" in (await provider.receive("status"))["msg"]

    asyncio.run(story())


def test_a_service_may_be_offered_while_its_last_provider_is_leaving(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            for turn in range(10):
                provider = await offer(clients, "/handed_on")
                peer.call("/handed_on", f"turn {turn}")
                await reply(provider, await provider.receive("call_service"), f"answer {turn}")
                assert await peer.heard() == f"answer {turn}"
                provider.leave()

    asyncio.run(story())
