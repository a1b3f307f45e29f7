"""Pages that are reloaded, and a ROS master that goes away and comes back."""

import asyncio
import signal
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.bridge_neighbours import PATIENCE, Clients, Peer, Socket, node
from fakes.bridge_puppet import Puppet, puppet

LOADS = 12


async def until(holds: Callable[[], Awaitable[bool]]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not await holds():
            await asyncio.sleep(0.05)


async def publishers(socket: Socket, topic: str) -> list[str]:
    found: list[str] = (await socket.call("/rosapi/publishers", args=[topic]))["values"]["publishers"]
    return found


@pytest.mark.parametrize("lingers", [True, False], ids=["at-once", "after-its-publisher-has-been-unregistered"])
def test_a_page_that_is_reloaded_loses_no_message(clients: Clients, peer: Peer, lingers: bool) -> None:
    """Each load gets what is latched, and what it says at once reaches a node that has listened all the time."""

    async def load(word: str) -> None:
        page = await clients.new()
        await page.send(op="advertise", topic="/to_echo", type="std_msgs/String", id="a")
        await page.send(op="publish", topic="/to_echo", msg={"data": word})
        await page.send(op="subscribe", topic="/latched", type="std_msgs/String", id="s")
        assert (await page.receive("publish"))["msg"] == {"data": "kept"}
        page.leave()

    async def story() -> None:
        async with clients:
            steady = await clients.new()

            async def is_forgotten() -> bool:
                return not await publishers(steady, "/to_echo")

            await steady.send(op="subscribe", topic="/echoed", type="std_msgs/String")
            await echoes(clients, steady)
            for number in range(LOADS if lingers else 3):
                if not lingers:
                    await until(is_forgotten)
                await load(f"load {number}")
                assert (await steady.receive("publish"))["msg"]["data"] == f"load {number}"

    asyncio.run(story())


BURST = 300


def test_all_that_is_published_at_once_reaches_a_node_that_has_listened_before(clients: Clients, ros_env: dict[str, str]) -> None:
    async def story(node: Puppet) -> None:
        async with clients:
            page = await clients.new()
            node.process.send_signal(signal.SIGSTOP)  # so that it connects after all has been published
            await page.send(op="advertise", topic="/burst", type="std_msgs/String", queue_size=BURST)
            for number in range(BURST):
                await page.send(op="publish", topic="/burst", msg={"data": str(number)})
            await page.settle()
            node.process.send_signal(signal.SIGCONT)

            async def is_heard() -> bool:
                return len(node.do("heard")) >= BURST

            await until(is_heard)
            assert node.do("heard") == [str(number) for number in range(BURST)]

    with puppet(ros_env, "early") as early:
        early.do("heard = []")
        early.do("rospy.Subscriber('/burst', String, lambda message: heard.append(message.data))")
        asyncio.run(story(early))


def test_a_page_may_know_that_not_all_it_publishes_at_once_is_kept(clients: Clients, ros_env: dict[str, str]) -> None:
    async def story() -> None:
        async with clients:
            page = await clients.new()
            await page.send(op="set_level", level="warning")
            await page.send(op="advertise", topic="/too_much", type="std_msgs/String", queue_size=10)
            for number in range(BURST):
                await page.send(op="publish", topic="/too_much", msg={"data": str(number)})
            assert "messages of /too_much until /frozen has connected" in (await page.receive("status"))["msg"]

    with puppet(ros_env, "frozen") as frozen:
        frozen.do("rospy.Subscriber('/too_much', String)")
        frozen.process.send_signal(signal.SIGSTOP)
        asyncio.run(story())


async def echoes(clients: Clients, listener: Socket) -> None:
    """Wait until the node's echo reaches the listener, by a publisher of its own."""
    speaker = await clients.new()
    heard = asyncio.create_task(listener.receive("publish"))
    while not heard.done():
        await speaker.send(op="publish", topic="/to_echo", msg={"data": "first"})
        await asyncio.wait({heard}, timeout=0.2)
    speaker.leave()
    last = asyncio.create_task(listener.receive("publish"))
    while await asyncio.wait({last}, timeout=0.5) and last.done():  # what was said meanwhile
        last = asyncio.create_task(listener.receive("publish"))
    last.cancel()


def test_a_publisher_whose_connection_breaks_while_it_stays_registered_is_heard_again(
    clients: Clients, ros_env: dict[str, str]
) -> None:
    async def story(node: Puppet) -> None:
        async with clients:
            listener = await clients.new()
            await listener.send(op="subscribe", topic="/broken", type="std_msgs/String")
            assert (await listener.receive("publish"))["msg"] == {"data": "kept"}
            node.do("[each.socket.shutdown(2) for each in publisher.impl.connections]")
            assert (await listener.receive("publish"))["msg"] == {"data": "kept"}  # it is latched, so a new connection has it again

    with puppet(ros_env, "breaking") as breaking:
        breaking.do("publisher = rospy.Publisher('/broken', String, latch=True, queue_size=1)")
        breaking.do("publisher.publish('kept')")
        asyncio.run(story(breaking))


def test_a_master_that_goes_away_and_comes_back_is_survived(start: Any, own_master: Any) -> None:
    with node(own_master.env, "old") as old:
        bridge = start("rapp_bridge", "--port", "0", "--call-timeout", "10", env=own_master.env)
        asyncio.run(_survive(Clients(f"ws://127.0.0.1:{bridge.ready['port']}"), old, own_master))
        assert "registering again" in Path(f"/proc/{bridge.process.pid}/fd/2").read_text()  # its log


async def _survive(clients: Clients, old: Peer, master: Any) -> None:
    async with clients:
        client, provider = await clients.new(), await clients.new()
        await client.send(op="subscribe", topic="/echoed", type="std_msgs/String")
        await provider.send(op="advertise_service", service="/offered", type="rapp_msgs/Say")
        await provider.settle()
        await echoes(clients, client)
        assert (await client.call("/say", args=["before"]))["values"]["message"] == "before"
        master.signal(signal.SIGKILL)
        master.stop()

        # what is connected stays connected; what needs the master is answered
        assert (await client.call("/say", args=["without"]))["values"]["message"] == "without"
        await provider.send(op="publish", topic="/new_topic", msg={"data": "x"}, id="p")
        assert "cannot ask the ROS master" in (await provider.receive("status"))["msg"]
        assert "cannot ask the ROS master" in (await client.call("/unknown"))["values"]

        master.start()
        await _serve_who_comes_later(client, provider, master)


async def _serve_who_comes_later(client: Socket, provider: Socket, master: Any) -> None:
    """A node that has joined the new master finds what the bridge had registered at the old one."""

    async def is_back() -> bool:
        return bool((await client.call("/rosapi/service_node", args=["/offered"]))["values"].get("node"))

    await until(is_back)
    with node({**master.env, "ROS_NAMESPACE": "/again"}, "young") as young:
        young.call("/offered", "after")
        request = await provider.receive("call_service")
        values = {"success": True, "message": request["args"]["text"]}
        await provider.send(op="service_response", service="/offered", id=request["id"], result=True, values=values)
        assert await young.heard() == "after"
        assert (await client.call("/again/say", args=["new"]))["values"]["message"] == "new"
        await client.send(op="subscribe", topic="/again/latched", type="std_msgs/String")
        while (await client.receive("publish"))["topic"] != "/again/latched":
            pass
