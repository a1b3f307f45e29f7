"""A world for the tests of one file; each test finds the robot standing."""

from collections.abc import Iterator

import pytest

from rapp_nao_sim.world.model import BODY
from rapp_nao_sim.world.process import WorldClient, WorldConfig


@pytest.fixture(scope="module")
def standing() -> Iterator[WorldClient]:
    with WorldClient(WorldConfig(pace=3.0, width=480, height=360)) as world:
        yield world


@pytest.fixture
def world(standing: WorldClient) -> WorldClient:
    standing.stop()
    standing.set_stiffness(BODY, [1.0] * len(BODY))
    if standing.posture()[0] != "Stand":
        assert standing.set_posture("Stand", 1.0)
    return standing
