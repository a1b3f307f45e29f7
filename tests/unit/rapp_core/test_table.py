"""One table lists all functions: it matches the ROS contract, the RAPP API, its doubles, and ARCHITECTURE's table."""

import inspect
import re
from pathlib import Path

import pytest

from rapp_api import communication, fake_body, navigation, ros_actions, vision
from rapp_api.core_agent import CoreAgent
from rapp_api.ros_core_agent import RosCoreAgent
from rapp_api.testing import FakeCoreAgent
from rapp_core.control import words
from rapp_core.services.table import CORE_SERVICES, CoreService
from rapp_hop.hz import manifest
from rapp_hop.hz.manifest import CORE_SERVICES as PERMITTED

ROOT = Path(__file__).parents[3]
MSGS = ROOT / "catkin_ws" / "src" / "rapp_msgs"
MODULES = {"communication": communication, "navigation": navigation, "vision": vision}
LEAVING_THE_RUN = {"CloudCall", "StopCloudAgent", "SendMail", "Keep"}
NOT_OF_THE_CORE = {"HopRequest"}
NOT_IN_THE_TABLE = {"rapp_say", "rapp_recognize", "rapp_record", "action_client"}
"""The paper's names of functions, and what makes a client."""

rows = pytest.mark.parametrize("row", CORE_SERVICES, ids=lambda row: row.name)
actions = pytest.mark.parametrize("row", [row for row in CORE_SERVICES if row.action], ids=lambda row: row.name)


def fields(path: Path) -> list[list[str]]:
    """Names of the fields of each part of a .srv or .action file."""
    return [re.findall(r"^[\w/]+(?:\[\d*\])? +(\w+) *(?:#.*)?$", part, re.MULTILINE) for part in path.read_text().split("---")]


def srv(row: CoreService) -> list[list[str]]:
    return fields(MSGS / "srv" / f"{row.srv}.srv")


def action(row: CoreService) -> list[list[str]]:
    return fields(MSGS / "action" / f"{row.srv}.action")


def test_every_service_of_the_contract_is_offered() -> None:
    offered = {row.srv for row in CORE_SERVICES}
    assert offered | LEAVING_THE_RUN | NOT_OF_THE_CORE == {path.stem for path in MSGS.glob("srv/*.srv")}


def test_every_action_of_the_contract_is_offered_and_has_a_client() -> None:
    offered = {row.srv for row in CORE_SERVICES if row.action}
    assert offered == {path.stem for path in MSGS.glob("action/*.action")}
    assert {row.name: row.srv for row in CORE_SERVICES if row.action} == ros_actions.ACTIONS
    assert set(ros_actions.ACTIONS) == set(fake_body.ACTIONS)


def test_every_function_of_the_deliverable_is_there() -> None:
    assert len(CORE_SERVICES) == 5 + 11 + 3


def test_names_are_given_once() -> None:
    for names in ([row.name for row in CORE_SERVICES], [row.srv for row in CORE_SERVICES], [row.api for row in CORE_SERVICES]):
        assert len(set(names)) == len(names)


@rows
def test_a_name_is_that_of_its_type(row: CoreService) -> None:
    long = {"TakePosture": "TakePredefinedPosture"}.get(row.srv, row.srv)  # DESIGN 3.1 calls the action so
    assert row.name == "rapp" + re.sub("([A-Z])", lambda found: "_" + found[1].lower(), long)


def test_a_package_can_be_permitted_what_is_offered_and_nothing_else() -> None:
    beside = {"rapp_cloud_call", "rapp_send_mail", "rapp_keep"}
    assert {row.name for row in CORE_SERVICES} | beside == PERMITTED


def test_the_store_knows_the_robot_s_own_words() -> None:
    assert manifest.STOP == words.STOP


@rows
def test_every_response_tells_success_and_why_not(row: CoreService) -> None:
    assert srv(row)[1][:3] == ["success", "message", "error"]


@actions
def test_an_action_asks_for_what_its_service_does_and_answers_the_same(row: CoreService) -> None:
    goal, result, feedback = action(row)
    assert [goal, result] == srv(row)
    assert feedback


@rows
def test_the_api_has_a_function_with_the_request_s_parameters(row: CoreService) -> None:
    module, _, name = row.api.partition(".")
    function = getattr(MODULES[module], name)
    assert len(inspect.signature(function).parameters) == len(srv(row)[0])
    assert function.__doc__


@pytest.mark.parametrize("module", MODULES)
def test_every_function_of_the_api_is_in_the_table(module: str) -> None:
    source = MODULES[module]
    made_here = [name for name, item in vars(source).items() if getattr(item, "__module__", "") == source.__name__]
    public = {f"{module}.{name}" for name in made_here if not name.startswith("_") and name not in NOT_IN_THE_TABLE}
    assert public == {row.api for row in CORE_SERVICES if row.api.startswith(f"{module}.")}


@pytest.mark.parametrize("agent", [RosCoreAgent, FakeCoreAgent])
def test_every_core_agent_has_all_calls_with_the_port_s_parameters(agent: type) -> None:
    for name, call in vars(CoreAgent).items():
        if not name.startswith("_"):
            assert list(inspect.signature(getattr(agent, name)).parameters) == list(inspect.signature(call).parameters)


@rows
def test_a_service_names_the_devices_it_holds(row: CoreService) -> None:
    assert set(row.resources) <= {"loudspeaker", "recogniser", "recorder", "legs", "arms", "head", "cameras"}


@rows
def test_what_begins_a_motion_holds_the_limbs_it_moves(row: CoreService) -> None:
    still = {"rapp_move_stop", "rapp_set_global_pose", "rapp_get_robot_pose", "rapp_get_transform"}
    assert row.moves == (row.api.startswith("navigation.") and row.name not in still)


def test_architecture_has_the_same_table() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text()
    listed = re.findall(r"^\| `(rapp_\w+)` \| (\w+)( \+ action)? \| `([\w.]+)` \| `services/(\w+)\.py` \|$", text, re.MULTILINE)
    expected = [
        (row.name, row.srv, " + action" if row.action else "", row.api, row.machine.__module__.rpartition(".")[2])
        for row in CORE_SERVICES
    ]
    assert listed == expected
