"""Tracks lead joints where and when they are told."""

import pytest

from rapp_nao_sim.world.model import JOINTS
from rapp_nao_sim.world.moves import clip, direct, ease, posture_time, through
from rapp_nao_sim.world.postures import load


def test_a_direct_track_keeps_the_speed_asked_for() -> None:
    track = direct("HeadYaw", 5.0, 0.0, 1.0, 0.5)
    speed = 0.5 * JOINTS["HeadYaw"].speed
    assert track.at(5.0) == 0.0
    assert track.at(5.1) == pytest.approx(0.1 * speed)
    assert track.end == pytest.approx(5.0 + 1 / speed)
    assert track.at(track.end) == track.at(99.0) == 1.0


def test_a_direct_track_to_where_the_joint_is_ends_at_once() -> None:
    track = direct("HeadYaw", 0.0, 0.3, 0.3, 1.0)
    assert track.end < 0.01
    assert track.at(0.0) == track.at(1.0) == 0.3


def test_a_track_passes_its_points_at_their_times() -> None:
    track = through(1.0, 0.0, [1.0, -1.0], [0.5, 2.0])
    assert [track.at(time) for time in (0.0, 1.0, 1.5, 3.0, 4.0)] == pytest.approx([0.0, 0.0, 1.0, -1.0, -1.0])
    assert track.at(1.25) == pytest.approx(0.5)
    assert track.at(2.25) == pytest.approx(0.0)


def test_easing_starts_and_ends_at_rest() -> None:
    assert ease(0.0) == 0.0 and ease(1.0) == 1.0 and ease(0.5) == 0.5
    assert ease(0.01) < 0.001 and ease(0.99) > 0.999


def test_angles_beyond_a_range_become_its_end() -> None:
    assert clip("HeadYaw", 9.0) == JOINTS["HeadYaw"].upper
    assert clip("HeadYaw", -9.0) == JOINTS["HeadYaw"].lower
    assert clip("HeadYaw", 0.2) == 0.2


def test_a_change_of_posture_takes_longer_when_slower_and_when_it_lies_down() -> None:
    known = load()
    stand, sit = dict(known["Stand"].angles), dict(known["Sit"].angles)
    full = posture_time(stand, sit, 0.4, 1.0)
    assert 0.5 < full < 3
    assert posture_time(stand, sit, 0.4, 0.5) == pytest.approx(2 * full)
    assert posture_time(stand, stand, 1.6, 1.0) == pytest.approx(2.0)
