"""A change of posture under way: where it brings joints and torso, kinematically."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rapp_nao_sim.world.body import Quaternion
from rapp_nao_sim.world.moves import ease
from rapp_nao_sim.world.postures import Posture


@dataclass(frozen=True)
class Change:
    """A change of posture under way."""

    number: int  # of the request that waits for it
    posture: Posture
    begin: float
    end: float
    angles: Mapping[str, float]  # at the beginning
    orientations: tuple[Quaternion, Quaternion]
    feet: tuple[float, float]
    release: bool  # remove the stiffness at the end

    def at(self, now: float, bullet: Any) -> tuple[dict[str, float], Quaternion]:
        """The joints and the torso's orientation at a time."""
        share = ease((now - self.begin) / (self.end - self.begin))
        angles = {name: start + (self.posture.angles[name] - start) * share for name, start in self.angles.items()}
        return angles, bullet.getQuaternionSlerp(*self.orientations, share)


def upright(bullet: Any, theta: float, pitch: float) -> Quaternion:
    """The orientation of a torso that looks to theta and leans forward by pitch."""
    turn, lean = bullet.getQuaternionFromEuler((0, 0, theta)), bullet.getQuaternionFromEuler((0, pitch, 0))
    orientation: Quaternion = bullet.multiplyTransforms((0, 0, 0), turn, (0, 0, 0), lean)[1]
    return orientation
