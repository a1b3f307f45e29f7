"""Which names one run may use (DESIGN section 3.6)."""

import json

import pytest

from rapp_core.gate.rules import Offered, Rules, from_json, rules_for
from rapp_core.ros.services import offered

OFFERED = Offered(
    "/core_agent", frozenset({"rapp_say", "rapp_move_to"}), frozenset({"rapp_cloud_call"}), {"rapp_move_to": "MoveTo"}
)
FORBIDDEN = ("/core_agent/get_loggers", "/rosapi/topics", "rapp_say", "/rapp_say/", "/other/rapp_say", "", "/rapp_hop/send_mail")


def test_nothing_is_allowed_by_default():
    rules = Rules()
    assert rules.service("/rapp_say")
    assert rules.publish("/rapp_move_to/goal")
    assert rules.subscribe("/rapp_move_to/status")


def test_only_what_package_json_names_and_the_core_agent_offers_is_allowed():
    rules = rules_for(["rapp_say", "rapp_record", "/core_agent/get_loggers"], OFFERED)
    assert rules.services == {"/rapp_say", "/rapp_cloud_call"}
    assert (dict(rules.publishes), rules.subscribes) == ({}, frozenset())


@pytest.mark.parametrize("name", FORBIDDEN)
def test_a_refusal_names_what_is_refused_and_where_it_would_be_permitted(name):
    refusal = rules_for(["rapp_say"], OFFERED).service(name)
    assert refusal == f"refused: cannot call {name}: the RApp's package.json does not name it under permissions.core"


def test_an_action_opens_its_topics_with_the_core_agent_s_types():
    rules = rules_for(["rapp_move_to"], OFFERED)
    assert rules.publishes == {"/rapp_move_to/goal": "rapp_msgs/MoveToActionGoal", "/rapp_move_to/cancel": "actionlib_msgs/GoalID"}
    assert rules.subscribes == {f"/rapp_move_to/{topic}" for topic in ("status", "feedback", "result")}
    assert rules.publish("/rapp_move_to/status")
    assert rules.subscribe("/rapp_move_to/goal")


@pytest.mark.parametrize("namespace", ["nao1", "/nao1", "/nao1/"])
def test_names_are_those_of_the_robot_s_namespace(namespace):
    rules = rules_for(["rapp_say"], OFFERED, namespace)
    assert rules.services == {"/nao1/rapp_say", "/nao1/rapp_cloud_call"}
    assert rules.service("/rapp_say")


def test_rules_cross_to_the_gate_as_json():
    rules = rules_for(["rapp_move_to", "rapp_say"], OFFERED, "a/b")
    assert from_json(json.loads(json.dumps(rules.as_json()))) == rules


def test_the_core_agent_offers_its_services_and_what_leaves_the_robot():
    real = offered("/core_agent")
    assert {"rapp_say", "rapp_keep", "rapp_move_to"} <= real.services
    assert {"rapp_cloud_call", "rapp_send_mail"} <= real.always
    assert real.actions["rapp_take_predefined_posture"] == "TakePosture"
    assert not any(name.startswith("rapp_hop") for name in real.services | real.always)
