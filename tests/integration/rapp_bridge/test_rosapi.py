"""Every service of rosapi, by clients, by relative names, and by ROS nodes."""

import asyncio
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest

from fakes.bridge_neighbours import PATIENCE, Clients, Peer
from fakes.bridge_puppet import Puppet, puppet
from fakes.bridge_workshop import workshop


@pytest.fixture(scope="module", autouse=True)
def _workshop(ros_env: dict[str, str]) -> Iterator[None]:
    with workshop(ros_env):
        yield


def ask(clients: Clients, name: str, *args: Any) -> Any:
    """The values of the answer, which has to be a good one."""

    async def story() -> Any:
        async with clients:
            answer = await (await clients.new()).call(f"/rosapi/{name}", args=list(args))
            assert answer["result"], answer
            return answer["values"]

    return asyncio.run(story())


@pytest.mark.parametrize(
    ("name", "args", "field", "holds"),
    [
        ("topics", (), "topics", "/workshop/image"),
        ("topics", (), "types", "sensor_msgs/LaserScan"),
        ("topics_for_type", ("sensor_msgs/LaserScan",), "topics", "/workshop/scan"),
        ("topics_and_raw_types", (), "topics", "/workshop/image"),
        ("topic_type", ("/workshop/image",), "type", "sensor_msgs/Image"),
        ("topic_type", ("workshop/image",), "type", "sensor_msgs/Image"),
        ("topic_type", ("/nowhere",), "type", ""),
        ("publishers", ("/workshop/image",), "publishers", "/workshop"),
        ("subscribers", ("/workshop/in",), "subscribers", "/workshop"),
        ("services", (), "services", "/say"),
        ("services", (), "services", "/rosapi/topics"),
        ("services_for_type", ("rapp_msgs/Say",), "services", "/say"),
        ("services_for_type", ("rosapi/Topics",), "services", "/rosapi/topics"),
        ("service_type", ("/say",), "type", "rapp_msgs/Say"),
        ("service_type", ("/nowhere",), "type", ""),
        ("service_providers", ("rapp_msgs/Say",), "providers", "/peer"),
        ("service_node", ("/say",), "node", "/peer"),
        ("service_node", ("/nowhere",), "node", ""),
        ("service_host", ("/say",), "host", "127.0.0.1"),
        ("nodes", (), "nodes", "/rosbridge"),
        ("node_details", ("/workshop",), "subscribing", "/workshop/in"),
        ("node_details", ("/workshop",), "publishing", "/workshop/out"),
        ("node_details", ("/workshop",), "services", "/workshop/get_loggers"),
        ("action_servers", (), "action_servers", "/workshop/count"),
        ("has_param", ("/workshop/size",), "exists", True),
        ("has_param", ("/nowhere",), "exists", False),
        ("get_param", ("/workshop/size", ""), "value", "96"),
        ("get_param", ("/nowhere", ""), "value", "null"),
        ("get_param", ("/nowhere", "7"), "value", "7"),
        ("get_param", ("/nowhere", "plain"), "value", '"plain"'),
        ("search_param", ("workshop/size",), "global_name", "/workshop/size"),
        ("get_param_names", (), "names", "/workshop/size"),
    ],
)
def test_answers(clients: Clients, peer: Peer, name: str, args: tuple[Any, ...], field: str, holds: Any) -> None:
    found = ask(clients, name, *args)[field]
    assert holds in found if isinstance(found, list) else holds == found


def test_parameters_are_set_as_json_and_deleted(clients: Clients) -> None:
    assert ask(clients, "set_param", "/set/here", '{"a": [1, 2.5, true, "ü"]}') == {}
    assert ask(clients, "get_param", "/set/here", "")["value"] == '{"a":[1,2.5,true,"ü"]}'
    assert ask(clients, "delete_param", "/set/here") == {}
    assert ask(clients, "has_param", "/set/here") == {"exists": False}


def test_what_parameters_cannot_hold_is_refused_with_the_reason(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            socket = await clients.new()
            for value, why in (
                ("[" * 40 + "]" * 40, "more than 32 deep"),
                ("null", "no null"),
                ("1e", "no JSON"),
                ('"\\u0000"', "XML"),
            ):
                answer = await socket.call("/rosapi/set_param", args=["/refused", value])
                assert (answer["result"], why in answer["values"]) == (False, True), answer

    asyncio.run(story())


def test_the_time(clients: Clients) -> None:
    before = time.time()
    assert before - 1 <= ask(clients, "get_time")["time"]["secs"] <= time.time()


def test_types_are_described_with_all_types_in_them(clients: Clients) -> None:
    typedefs = ask(clients, "message_details", "sensor_msgs/Range")["typedefs"]
    assert [each["type"] for each in typedefs] == ["sensor_msgs/Range", "std_msgs/Header", "time"]
    found = typedefs[0]
    assert dict(zip(found["constnames"], found["constvalues"], strict=True)) == {"ULTRASOUND": "0", "INFRARED": "1"}
    scan = ask(clients, "message_details", "sensor_msgs/LaserScan")["typedefs"][0]
    kinds = dict(zip(scan["fieldnames"], zip(scan["fieldtypes"], scan["fieldarraylen"], strict=True), strict=True))
    assert (kinds["ranges"], kinds["angle_min"]) == (("float32", 0), ("float32", -1))
    assert ask(clients, "service_request_details", "std_srvs/SetBool")["typedefs"][0]["fieldnames"] == ["data"]
    assert ask(clients, "service_response_details", "std_srvs/SetBool")["typedefs"][0]["fieldtypes"] == ["bool", "string"]


CALLER = """
import rospy, sys
from rosapi.srv import GetParam, TopicType
rospy.init_node("asker", anonymous=True, disable_signals=True)
for name, kind in (("/rosapi/topic_type", TopicType), ("/rosapi/get_param", GetParam)):
    rospy.wait_for_service(name, 10)
print(rospy.ServiceProxy("/rosapi/topic_type", TopicType)("/workshop/scan").type)
print(rospy.ServiceProxy("/rosapi/get_param", GetParam)("/workshop/size", "").value)
rospy.signal_shutdown("asked")
"""


def test_a_ros_node_may_ask_too(bridge: Any, ros_env: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", CALLER], env=ros_env, capture_output=True, text=True, timeout=2 * PATIENCE, check=False
    )
    assert done.stdout.split() == ["sensor_msgs/LaserScan", "96"], done.stderr


def test_who_is_connected_is_published(clients: Clients, url: str) -> None:
    async def story() -> None:
        async with clients, Clients(url) as others:
            watcher = await clients.new()
            await watcher.send(op="subscribe", topic="/client_count", type="std_msgs/Int32")
            await watcher.send(op="subscribe", topic="/connected_clients", type="rosbridge_msgs/ConnectedClients")

            async def become(count: int) -> None:
                counted = listed = -1
                while (counted, listed) != (count, count):
                    message = await watcher.receive("publish")
                    if message["topic"] == "/client_count":
                        counted = message["msg"]["data"]
                    else:
                        listed = len(message["msg"]["clients"])
                        assert all(each["ip_address"] == "127.0.0.1" for each in message["msg"]["clients"])

            await become(1)
            coming = [await others.new() for _ in range(2)]
            await become(3)
            coming[0].leave()
            await become(2)

    asyncio.run(story())


def test_the_type_of_a_service_is_that_of_the_moment(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            asking = await clients.new()
            for kind in ("std_srvs/Empty", "std_srvs/Trigger"):
                provider = await clients.new()
                await provider.send(op="advertise_service", service="/changing", type=kind)
                await provider.settle()
                assert (await asking.call("/rosapi/service_type", args=["/changing"]))["values"] == {"type": kind}
                assert "/changing" in (await asking.call("/rosapi/services_for_type", args=[kind]))["values"]["services"]

    asyncio.run(story())


def test_the_type_of_a_node_s_service_is_asked_again_after_a_while(start: Any, own_master: Any) -> None:
    async def story(clients: Clients, changing: Puppet) -> None:
        async with clients:
            asking = await clients.new()
            for kind in ("Empty", "Trigger"):
                changing.do(f"service = rospy.Service('/changing', {kind}, lambda request: None)")
                async with asyncio.timeout(PATIENCE):
                    while (await asking.call("/rosapi/service_type", args=["/changing"]))["values"]["type"] != f"std_srvs/{kind}":
                        await asyncio.sleep(0.05)
                changing.do("service.shutdown()")

    with puppet(own_master.env, "changing") as node:
        bridge = start("rapp_bridge", "--port", "0", "--connection-age", "0.5", env=own_master.env)
        asyncio.run(story(Clients(f"ws://127.0.0.1:{bridge.ready['port']}"), node))
