"""Calls of ROS services by clients."""

import asyncio
from typing import Any

from fakes.bridge_neighbours import PATIENCE, Clients, Socket, node
from fakes.bridge_puppet import Puppet, puppet


def test_one_slow_call_of_a_client_delays_none_of_its_fifty_others(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            socket = await clients.new()
            await socket.send(op="call_service", id="slow", service="/say", args={"text": "slow"})
            for number in range(50):
                await socket.send(op="call_service", id=f"c{number}", service="/say", args=[f"text {number}"])
            answers = [await socket.receive("service_response") for _ in range(50)]
            assert {a["id"]: a["values"]["message"] for a in answers} == {f"c{n}": f"text {n}" for n in range(50)}
            await socket.send(op="call_service", id="go", service="/say", args=["go"])
            last = {a["id"]: a["values"]["message"] for a in [await socket.receive("service_response") for _ in range(2)]}
            assert last == {"go": "go", "slow": "slow"}

    asyncio.run(story())


def test_more_slow_calls_than_connections_block_only_their_own_service(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            socket, provider = await clients.new(), await clients.new()
            await provider.send(op="advertise_service", service="/never", type="rapp_msgs/Say")
            await provider.settle()
            for number in range(200):
                await socket.send(op="call_service", id=number, service="/never", timeout=15)
            assert (await socket.call("/say", args=["through"], id="x"))["values"]["message"] == "through"

    asyncio.run(story())


def test_failures_of_a_call_are_answers_with_result_false(clients: Clients) -> None:
    async def story() -> dict[str, str]:
        async with clients:
            socket = await clients.new()
            await socket.send(op="call_service", id="fails", service="/say", args={"text": "fail"})
            await socket.send(op="call_service", id="unknown", service="/nowhere")
            await socket.send(op="call_service", id="wrong", service="/say", args={"volume": 1})
            await socket.send(op="call_service", id="late", service="/say", args={"text": "slow"}, timeout=0.3)
            await socket.send(op="call_service", id="kind", service="/say", args=[3])
            answers = [await socket.receive("service_response") for _ in range(5)]
            assert not any(a["result"] for a in answers)
            return {a["id"]: a["values"] for a in answers}

    texts = asyncio.run(story())
    assert "no voice" in texts["fails"]
    assert "no such service" in texts["unknown"]
    assert "no field volume" in texts["wrong"]
    assert "a string is needed" in texts["kind"]
    assert "no answer in 0.3 s" in texts["late"]


def test_a_call_ends_with_the_time_out_it_brings(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            socket, provider = await clients.new(), await clients.new()
            await provider.send(op="advertise_service", service="/silent", type="rapp_msgs/Say")
            await provider.settle()
            answer = await socket.call("/silent", timeout=0.2)
            assert "no answer in 0.2 s" in answer["values"]
            request = await provider.receive("call_service")
            late = {
                "op": "service_response",
                "service": "/silent",
                "id": request["id"],
                "result": True,
                "values": {"message": "late"},
            }
            await provider.send(**late)
            assert "nobody waits" in (await provider.receive("status"))["msg"]

    asyncio.run(story())


def test_a_node_that_dies_in_a_call_is_told_and_its_successor_is_found(clients: Clients, ros_env: dict[str, str]) -> None:
    async def story() -> None:
        async with clients:
            socket = await clients.new()
            with node({**ros_env, "ROS_NAMESPACE": "/mortal"}, "mortal"):
                assert (await socket.call("/mortal/say", args=["hello"]))["values"]["message"] == "hello"
                answer = await socket.call("/mortal/say", args=["die"])
                assert (answer["result"], "its node closed the connection" in answer["values"]) == (False, True)
                gone = await socket.call("/mortal/say", args=["anybody"])
                assert gone["result"] is False
            with node({**ros_env, "ROS_NAMESPACE": "/mortal"}, "mortal"):
                assert (await socket.call("/mortal/say", args=["reborn"]))["values"]["message"] == "reborn"

    asyncio.run(story())


def test_a_caller_that_leaves_harms_nobody(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            leaving, staying, provider = await clients.new(), await clients.new(), await clients.new()
            await provider.send(op="advertise_service", service="/asked", type="rapp_msgs/Say")
            await provider.settle()
            await leaving.send(op="call_service", service="/asked", args=["one"])
            request = await provider.receive("call_service")
            leaving.leave()
            await staying.settle()
            await provider.send(op="service_response", service="/asked", id=request["id"], result=True, values={})
            await provider.settle()
            assert (await staying.call("/say", args=["fine"]))["values"]["message"] == "fine"

    asyncio.run(story())


SLOW = 0.5  # s
CROWD = 70  # more than the connections to one service


async def answers(socket: Socket, count: int) -> dict[str, str]:
    """What calls have come to: the message, or the error."""
    found = [await socket.receive("service_response") for _ in range(count)]
    return {each["id"]: each["values"]["message"] if each["result"] else each["values"] for each in found}


def test_more_calls_than_connections_are_all_answered_though_connections_grow_old(start: Any, own_master: Any) -> None:
    async def story(clients: Clients) -> None:
        async with clients:
            socket = await clients.new()
            for number in range(CROWD):
                await socket.send(op="call_service", id=str(number), service="/slow")
            assert await answers(socket, CROWD) == {str(number): "slow" for number in range(CROWD)}

    with puppet(own_master.env, "slow") as slow:
        slow.do(f"rospy.Service('/slow', Trigger, lambda _: time.sleep({SLOW}) or TriggerResponse(True, 'slow'))")
        bridge = start("rapp_bridge", "--port", "0", "--call-timeout", "30", "--connection-age", str(SLOW / 2), env=own_master.env)
        asyncio.run(story(Clients(f"ws://127.0.0.1:{bridge.ready['port']}")))


def test_calls_that_wait_for_a_connection_are_told_when_the_node_dies(clients: Clients, ros_env: dict[str, str]) -> None:
    async def story(stuck: Puppet) -> None:
        async with clients:
            socket = await clients.new()
            for number in range(CROWD):
                await socket.send(op="call_service", id=str(number), service="/stuck")
            while stuck.do("len(asked)") < 64:
                await asyncio.sleep(0.05)
            stuck.process.kill()
            texts = (await answers(socket, CROWD)).values()
            assert not any("cannot wait longer" in text for text in texts)
            assert sum("its node closed" in text for text in texts) == 64

    with puppet(ros_env, "stuck") as node:
        node.do(STUCK)
        asyncio.run(story(node))


def test_calls_that_wait_are_told_when_the_service_is_withdrawn(clients: Clients, ros_env: dict[str, str]) -> None:
    async def story(stuck: Puppet) -> None:
        async with clients:
            socket = await clients.new()
            await socket.send(op="call_service", id="first", service="/stuck")
            while stuck.do("len(asked)") < 1:
                await asyncio.sleep(0.05)
            stuck.do("service.shutdown()")
            assert "no such service" in (await socket.call("/stuck", id="second"))["values"]
            stuck.do("gate.set()")
            assert (await socket.receive("service_response"))["values"]["message"] == "free"

    with puppet(ros_env, "stuck") as node:
        node.do(STUCK)
        asyncio.run(story(node))


def test_a_service_that_is_withdrawn_is_called_no_longer_though_its_node_serves_the_connection_on(
    start: Any, own_master: Any
) -> None:
    async def story(clients: Clients, node: Puppet) -> None:
        async with clients:
            socket = await clients.new()
            assert (await socket.call("/withdrawn"))["values"]["message"] == "old"
            node.do("service.shutdown()")
            async with asyncio.timeout(PATIENCE):
                while (answer := await socket.call("/withdrawn"))["result"]:
                    await asyncio.sleep(0.05)
            assert "no such service" in answer["values"]
            node.do("service = rospy.Service('/withdrawn', Trigger, lambda _: TriggerResponse(True, 'new'))")
            assert (await socket.call("/withdrawn"))["values"]["message"] == "new"

    with puppet(own_master.env, "withdrawing") as withdrawing:
        withdrawing.do("service = rospy.Service('/withdrawn', Trigger, lambda _: TriggerResponse(True, 'old'))")
        bridge = start("rapp_bridge", "--port", "0", "--connection-age", "600", env=own_master.env)
        asyncio.run(story(Clients(f"ws://127.0.0.1:{bridge.ready['port']}"), withdrawing))


STUCK = """
asked, gate = [], threading.Event()
def stick(request):
    asked.append(1)
    gate.wait(60)
    return TriggerResponse(True, "free")
service = rospy.Service("/stuck", Trigger, stick)
"""
