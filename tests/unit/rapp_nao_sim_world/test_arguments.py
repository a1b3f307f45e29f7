"""The shapes in which NAOqi's clients name joints and give values."""

import math

import pytest

from rapp_nao_sim.naoqi import NaoqiError
from rapp_nao_sim.world.arguments import MOST_POINTS, joints, spread, ways
from rapp_nao_sim.world.model import BODY


def test_names_are_joints_groups_or_lists_of_them() -> None:
    assert joints("HeadYaw") == ["HeadYaw"]
    assert joints("Body") == BODY
    assert joints(["Head", "LHand"]) == ["HeadYaw", "HeadPitch", "LHand"]
    with pytest.raises(NaoqiError, match="Tail"):
        joints(["Head", "Tail"])


def test_one_value_serves_all_joints() -> None:
    assert spread(1, 3) == [1.0, 1.0, 1.0]
    assert spread([0.5, 1], 2) == [0.5, 1.0]
    for wrong in ([1.0], "1", None, math.inf, True):
        with pytest.raises(NaoqiError):
            spread(wrong, 2)


def test_values_over_time() -> None:
    assert ways([[1, 2], [3]], 2) == [[1.0, 2.0], [3.0]]
    assert ways([1, 2], 1) == [[1.0, 2.0]]
    assert ways([1, 2], 2) == [[1.0], [2.0]]
    assert ways(1.5, 2) == [[1.5], [1.5]]
    for wrong in ([[1], []], [[1]], [[0.0] * MOST_POINTS, [0.0]], []):
        with pytest.raises(NaoqiError):
            ways(wrong, 2)
