"""The table of core services matches the ROS contract, the RAPP API, and ARCHITECTURE's words for them."""

import inspect
import re
from pathlib import Path

import pytest

from rapp_api import communication
from rapp_core.services.table import CORE_SERVICES, CoreService

SRV = Path(__file__).parents[3] / "catkin_ws" / "src" / "rapp_msgs" / "srv"
LEAVING_THE_ROBOT = {"CloudCall", "SendMail"}
NOT_OF_THE_CORE = {"HopRequest"}


def fields(srv: str) -> tuple[list[str], list[str]]:
    """Names of a service's request and response."""
    halves = (SRV / f"{srv}.srv").read_text().split("---")
    request, response = (re.findall(r"^[\w\[\]]+ +(\w+)", half, re.MULTILINE) for half in halves)
    return request, response


def test_every_service_of_the_contract_is_offered() -> None:
    offered = {row.srv for row in CORE_SERVICES}
    assert offered | LEAVING_THE_ROBOT | NOT_OF_THE_CORE == {path.stem for path in SRV.glob("*.srv")}


def test_names_are_given_once() -> None:
    for names in ([row.name for row in CORE_SERVICES], [row.srv for row in CORE_SERVICES], [row.api for row in CORE_SERVICES]):
        assert len(set(names)) == len(names)


@pytest.mark.parametrize("row", CORE_SERVICES, ids=lambda row: row.name)
def test_every_response_tells_success_and_why_not(row: CoreService) -> None:
    assert fields(row.srv)[1][:2] == ["success", "message"]


@pytest.mark.parametrize("row", CORE_SERVICES, ids=lambda row: row.name)
def test_the_api_has_a_function_with_the_request_s_parameters(row: CoreService) -> None:
    module, _, function = row.api.partition(".")
    assert module == "communication"
    assert len(inspect.signature(getattr(communication, function)).parameters) == len(fields(row.srv)[0])


@pytest.mark.parametrize("row", CORE_SERVICES, ids=lambda row: row.name)
def test_a_service_names_the_devices_it_holds(row: CoreService) -> None:
    assert row.resources
    assert set(row.resources) <= {"loudspeaker", "recogniser", "recorder"}
