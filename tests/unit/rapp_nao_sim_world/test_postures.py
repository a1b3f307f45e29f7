"""The posture file covers the body, and postures are recognised from joints and lean."""

from pathlib import Path

import pytest

from rapp_nao_sim.world import postures
from rapp_nao_sim.world.errors import Invalid
from rapp_nao_sim.world.model import BODY, JOINTS

KNOWN = postures.load()


def test_naoqis_postures_are_there() -> None:
    assert set(KNOWN) >= {"Stand", "StandInit", "StandZero", "Crouch", "Sit", "SitRelax", "LyingBelly", "LyingBack"}


@pytest.mark.parametrize("name", KNOWN)
def test_a_posture_has_every_joint_within_its_range(name: str) -> None:
    posture = KNOWN[name]
    assert list(posture.angles) == BODY
    for joint, angle in posture.angles.items():
        assert JOINTS[joint].lower - 1e-3 <= angle <= JOINTS[joint].upper + 1e-3
    assert posture.angles["LHipYawPitch"] == posture.angles["RHipYawPitch"]


@pytest.mark.parametrize("name", KNOWN)
def test_a_posture_is_recognised_whatever_the_head_does(name: str) -> None:
    posture = KNOWN[name]
    angles = {**posture.angles, "HeadYaw": 1.5, "LHand": 1.0}
    assert postures.recognise(KNOWN, angles, posture.pitch, 0.0) == name


def test_the_joints_of_a_posture_without_its_lean_are_not_it() -> None:
    assert postures.recognise(KNOWN, KNOWN["Stand"].angles, 1.5, 0.0) == "Unknown"
    assert postures.recognise(KNOWN, {**KNOWN["Stand"].angles, "LElbowYaw": 0.5}, 0.0, 0.0) == "Unknown"


@pytest.mark.parametrize(
    ("lean", "hips", "family"),
    [
        ((0.0, 0.0), 0.25, "Standing"),
        ((-0.4, 0.0), 0.05, "Sitting"),
        ((1.5, 0.0), 0.05, "LyingBelly"),
        ((-1.5, 0.0), 0.05, "LyingBack"),
        ((0.0, 1.5), 0.05, "LyingRight"),
        ((0.0, -1.5), 0.05, "LyingLeft"),
    ],
)
def test_families_follow_the_lean(lean: tuple[float, float], hips: float, family: str) -> None:
    assert postures.family(*lean, hips) == family
    assert family in postures.FAMILIES


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("HeadYaw = 0.0", "HeadRoll = 0.0", "HeadRoll, HeadYaw"),
        ("HeadYaw = 0.0", "HeadYaw = 9.0", "HeadYaw = 9.0 is beyond its range"),
        ('family = "Standing"', 'family = "Floating"', "needs a family"),
        ("[Stand]", "[Stand", "cannot read postures"),
    ],
)
def test_a_wrong_file_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    file = tmp_path / "postures.toml"
    file.write_text(postures.FILE.read_text().replace(old, new, 1))
    with pytest.raises(Invalid, match=r"^cannot ") as caught:
        postures.load(file)
    assert said in str(caught.value)
