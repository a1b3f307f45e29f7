"""Subscriptions beside a stand-in for rospy, whose threads come between in an order that no busy process can be made to keep."""

import asyncio
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from std_msgs.msg import String

from rapp_bridge import subscriptions
from rapp_bridge.blocking import Blocking
from rapp_bridge.config import Config
from rapp_bridge.errors import Invalid
from rapp_bridge.node import Marker
from rapp_bridge.protocol import Subscribe, Unsubscribe
from rapp_bridge.tcpros import encode_header

PUBLISHER = "http://node:1"
HEADER = encode_header({"type": String._type, "md5sum": String._md5sum})


async def until(holds: Callable[[], object]) -> None:
    async with asyncio.timeout(10):
        while not holds():
            await asyncio.sleep(0.01)


async def subscribe(held: subscriptions.Subscriptions, client: Any, kind: str) -> None:
    """Subscribe to a topic that was not open, and wait until it is."""
    waiting = held.subscribe(client, Subscribe("/topic", kind))
    assert waiting is not None
    await waiting


@pytest.fixture
def markers(monkeypatch: pytest.MonkeyPatch) -> list[Marker]:
    """The connections that rospy was told of."""
    told: list[Marker] = []
    rospys = SimpleNamespace(add_connection=lambda marker: told.append(marker) or True)
    monkeypatch.setattr(subscriptions, "get_topic_manager", lambda: SimpleNamespace(get_subscriber_impl=lambda name: rospys))
    monkeypatch.setattr(subscriptions, "registered", lambda *_: SimpleNamespace(unregister=lambda: None))
    monkeypatch.setattr(subscriptions, "topic_type", lambda _master, _name, wanted: wanted)
    return told


def test_a_publisher_that_registers_again_is_connected_to_though_the_old_link_s_end_waits(markers: list[Marker]) -> None:
    async def story() -> None:
        links: list[asyncio.StreamWriter] = []

        async def serve(_reader: Any, writer: asyncio.StreamWriter) -> None:
            writer.write(HEADER)
            links.append(writer)

        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        address = server.sockets[0].getsockname()
        master: Any = None
        client: Any = object()
        held = subscriptions.Subscriptions(Config(), master, Blocking(1))
        await subscribe(held, client, "std_msgs/String")
        assert held.connect("/topic", PUBLISHER, address)
        await until(lambda: markers)
        markers[0].close()  # as rospy's thread does, while the loop is busy
        held.connect("/topic", PUBLISHER, address)
        await until(lambda: len(links) == 2 and len(markers) == 2)
        server.close()

    asyncio.run(story())


@pytest.mark.usefixtures("markers")
def test_a_topic_that_nobody_wants_any_more_is_opened_anew_for_another_type() -> None:
    async def story() -> None:
        master: Any = None
        client: Any = object()
        held = subscriptions.Subscriptions(Config(), master, Blocking(1))
        for kind in ("std_msgs/String", "std_msgs/Int32"):
            await subscribe(held, client, kind)
            with pytest.raises(Invalid, match=f"it is {kind}"):
                held.subscribe(client, Subscribe("/topic", "std_msgs/Float32"))
            held.unsubscribe(client, Unsubscribe("/topic"))

    asyncio.run(story())


def test_a_connection_of_a_topic_that_was_opened_anew_meanwhile_is_closed(markers: list[Marker]) -> None:
    async def story() -> None:
        begun, go_on, over = asyncio.Event(), asyncio.Event(), asyncio.Event()

        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            begun.set()
            await go_on.wait()
            writer.write(HEADER)
            while await reader.read(1000):
                pass
            over.set()

        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        master: Any = None
        client: Any = object()
        held = subscriptions.Subscriptions(Config(), master, Blocking(1))
        for kind in ("std_msgs/String", "std_msgs/Int32"):
            await subscribe(held, client, kind)
            if not begun.is_set():
                held.connect("/topic", PUBLISHER, server.sockets[0].getsockname())
                await begun.wait()
                held.unsubscribe(client, Unsubscribe("/topic"))
        go_on.set()
        await asyncio.wait_for(over.wait(), 10)
        assert not markers
        server.close()

    asyncio.run(story())
