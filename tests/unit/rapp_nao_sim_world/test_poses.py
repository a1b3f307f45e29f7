"""Poses on the floor are turned into each other's frames."""

import math

import pytest

from rapp_nao_sim.world.poses import between, compose, inverse, relative, wrap

ONE, OTHER = (1.0, 2.0, math.pi / 2), (1.0, 3.0, -math.pi / 2)


def test_a_pose_in_another_frame() -> None:
    x, y, theta = relative(ONE, OTHER)
    assert (x, y) == pytest.approx((1.0, 0.0))
    assert abs(theta) == pytest.approx(math.pi)


def test_composing_undoes_it() -> None:
    assert compose(ONE, relative(ONE, OTHER)) == pytest.approx(OTHER)
    assert compose(ONE, inverse(ONE)) == pytest.approx((0, 0, 0))


def test_headings_take_the_short_way() -> None:
    assert wrap(3 * math.pi / 2) == pytest.approx(-math.pi / 2)
    half = between((0.0, 0.0, 3.0), (1.0, 2.0, -3.0), 0.5)
    assert half[:2] == (0.5, 1.0)
    assert abs(half[2]) == pytest.approx(math.pi)
