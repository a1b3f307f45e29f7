"""The drawings in ARCHITECTURE.md are those of the code. `RAPP_DRAW=1 ./rapp test -- tests/unit/drawings` writes them anew."""

import importlib.util
from unittest.mock import create_autospec

import pytest

from fakes.drawings import assert_kept
from rapp_agent import Machine, to_mermaid
from rapp_api import DynamicAgent
from rapp_cli.paths import STORE
from rapp_core.control.fsm import Acts, core_machine


def voice_mail() -> Machine:
    spec = importlib.util.spec_from_file_location("voice_mail_agent", STORE / "voice_mail" / "agent.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    machine: Machine = module.VoiceMail().task()
    return machine


MACHINES = {
    "core": lambda: core_machine(create_autospec(Acts, instance=True)),
    "dynamic": lambda: DynamicAgent().machine(lambda: None, lambda _error: None),
    "voice_mail": voice_mail,
}


@pytest.mark.parametrize("name", MACHINES)
def test_the_drawing_is_that_of_the_code(name: str) -> None:
    assert_kept(name, to_mermaid(MACHINES[name]()), "tests/unit/drawings")
