"""The ROS master that a RApp's node sees: what it tells, what it refuses, what it passes on."""

import asyncio
from typing import Any

import pytest

from rapp_core.errors import Unreachable
from rapp_core.gate.master import Master
from rapp_core.gate.rules import Offered, rules_for

ME, API = "/probe", "http://127.0.0.1:4000/"
GATE = "http://127.0.0.1:5000/"
OFFERED = Offered("/core_agent", frozenset({"rapp_say", "rapp_move_to"}), frozenset(), {"rapp_move_to": "MoveTo"})


class Robot:
    """The robot's real ROS, as far as the gate asks it; it notes what it is asked."""

    node = "/dynamic_agent_1"

    def __init__(self) -> None:
        self.asked: list[tuple[str, ...]] = []
        self.away = False

    async def service(self, name: str) -> tuple[str, int]:
        self.asked.append(("service", name))
        if self.away:
            raise Unreachable("cannot lookupService: no provider")
        return "127.0.0.1", 1

    async def register(self, topic: str, kind: str, api: str) -> None:
        self.asked.append(("register", topic, kind, api))
        if self.away:
            raise Unreachable("cannot ask the ROS master")

    async def unregister(self, topic: str, api: str) -> None:
        self.asked.append(("unregister", topic, api))


class Subject:
    """A master in front of that robot."""

    def __init__(self, *core: str) -> None:
        self.robot = Robot()
        self.master = Master(self.robot, "http://127.0.0.1:11311/", 77)  # type: ignore[arg-type]
        if core:
            self.master.rules = rules_for(core, OFFERED)
            self.master.publish_api = self._publish_api

    async def _publish_api(self) -> str:
        return GATE

    def call(self, method: str, *words: Any) -> tuple[int, str, Any]:
        return asyncio.run(self.master.answer(method, list(words)))


INIT = [
    ("getParam", (ME, "/use_sim_time"), False),
    ("getParam", (ME, "/tcp_keepalive"), True),
    ("registerService", (ME, ME + "/get_loggers", "rosrpc://127.0.0.1:4001", API), 1),
    ("unregisterService", (ME, ME + "/get_loggers", "rosrpc://127.0.0.1:4001"), 1),
    ("registerPublisher", (ME, "/rosout", "rosgraph_msgs/Log", API), []),
]


@pytest.mark.parametrize("core", [(), ("rapp_say", "rapp_move_to")])
@pytest.mark.parametrize(("method", "words", "value"), INIT)
def test_what_a_node_needs_to_begin_and_end_is_answered_here(core, method, words, value):
    subject = Subject(*core)
    assert subject.call(method, *words) == (1, "", value)
    assert subject.robot.asked == []


HOSTILE = [
    ("registerPublisher", (ME, "/core_agent/state", "rapp_msgs/AgentState", API)),
    ("registerPublisher", (ME, "/rapp_move_to/status", "actionlib_msgs/GoalStatusArray", API)),
    ("registerPublisher", (ME, "/rapp_take_predefined_posture/goal", "rapp_msgs/TakePostureActionGoal", API)),
    ("registerSubscriber", (ME, "/rapp_hop/events", "*", API)),
    ("registerSubscriber", (ME, "/rapp_move_to/goal", "*", API)),
    ("registerService", (ME, "/rapp_say", "rosrpc://127.0.0.1:4001", API)),
    ("registerService", (ME, "/rapp_hop/send_mail", "rosrpc://127.0.0.1:4001", API)),
    ("registerService", ("/core_agent", "/rapp_say", "rosrpc://127.0.0.1:4001", API)),
    ("requestTopic", (ME, "/core_agent/state", [["TCPROS"]])),
    ("lookupNode", (ME, "/core_agent")),
    ("setParam", (ME, "/use_sim_time", True)),
    ("deleteParam", (ME, "/use_sim_time")),
    ("getParam", (ME, "/")),
    ("searchParam", (ME, "run_id")),
    ("shutdown", (ME, "please")),
    ("publisherUpdate", (ME, "/rapp_move_to/goal", [API])),
    ("system.listMethods", ()),
    ("registerPublisher", (ME,)),
    ("registerPublisher", (ME, ["/rapp_move_to/goal"], "", API)),
    ("lookupService", (7, "/rapp_say")),
    ("answer", (ME,)),
    ("__init__", (ME,)),
]


@pytest.mark.parametrize(("method", "words"), HOSTILE)
def test_all_else_is_refused_and_does_not_reach_the_robot(method, words):
    subject = Subject("rapp_say", "rapp_move_to")
    code, text, _ = subject.call(method, *words)
    assert code == -1
    assert "cannot" in text
    assert subject.robot.asked == []


def test_unregistering_what_is_another_s_does_nothing():
    subject = Subject("rapp_say", "rapp_move_to")
    subject.call("unregisterService", "/core_agent", "/rapp_say", "rosrpc://127.0.0.1:4001")
    subject.call("unregisterPublisher", "/core_agent", "/core_agent/state", API)
    subject.call("unregisterSubscriber", "/core_agent", "/rapp_hop/events", API)
    assert subject.robot.asked == []


def test_the_robot_is_not_shown():
    subject = Subject("rapp_say")
    assert subject.call("getSystemState", ME) == (1, "", [[], [], []])
    assert subject.call("getPublishedTopics", ME, "") == (1, "", [])
    assert subject.call("getTopicTypes", ME) == (1, "", [])
    assert subject.call("getParamNames", ME)[2] == ["/use_sim_time", "/tcp_keepalive"]


def test_a_permitted_service_is_behind_the_relay_when_it_is_there():
    subject = Subject("rapp_say")
    assert subject.call("lookupService", ME, "/rapp_say") == (1, "", "rosrpc://127.0.0.1:77")
    subject.robot.away = True
    assert subject.call("lookupService", ME, "/rapp_say")[0] == -1


def test_a_service_that_is_not_permitted_is_answered_by_a_connection_that_says_why_and_nobody_is_asked():
    subject = Subject("rapp_say")
    assert subject.call("lookupService", ME, "/rapp_move_to") == (1, "", "rosrpc://127.0.0.1:77")
    assert subject.robot.asked == []


def test_the_robot_hears_of_a_publisher_under_the_gate_s_address_and_with_the_core_agent_s_type():
    subject = Subject("rapp_move_to")
    assert subject.call("registerPublisher", "/core_agent", "/rapp_move_to/goal", "evil/Type", API)[0] == 1
    assert subject.robot.asked == [("register", "/rapp_move_to/goal", "rapp_msgs/MoveToActionGoal", GATE)]
    assert subject.master.publishers == {"/rapp_move_to/goal": 4000}
    assert subject.call("unregisterPublisher", ME, "/rapp_move_to/goal", API) == (1, "", 1)
    assert subject.robot.asked[1:] == [("unregister", "/rapp_move_to/goal", GATE)]


def test_a_node_may_try_again_when_the_robot_s_master_is_away():
    subject = Subject("rapp_move_to")
    subject.robot.away = True
    with pytest.raises(Unreachable):
        subject.call("registerPublisher", ME, "/rapp_move_to/goal", "*", API)


@pytest.mark.parametrize("api", ["", "http://127.0.0.1/", "http://127.0.0.1:99999/", "nonsense", "http://[::1", 7])
def test_an_address_that_is_none_is_refused(api):
    subject = Subject("rapp_move_to")
    assert subject.call("registerPublisher", ME, "/rapp_move_to/goal", "*", api)[0] == -1
    assert subject.robot.asked == []


def test_what_it_hears_comes_from_the_gate():
    subject = Subject("rapp_move_to")
    assert subject.call("registerSubscriber", ME, "/rapp_move_to/status", "*", API) == (1, "", ["http://127.0.0.1:11311/"])
    assert subject.call("requestTopic", ME, "/rapp_move_to/status", [["TCPROS"]]) == (1, "", ["TCPROS", "127.0.0.1", 77])
