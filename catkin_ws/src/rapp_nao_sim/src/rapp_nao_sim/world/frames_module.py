"""The half of ALMotion that tells where the body's parts are, and what they weigh, after NAOqi 2.1."""

from typing import Any

from rapp_nao_sim.naoqi import Module
from rapp_nao_sim.world.arguments import joints
from rapp_nao_sim.world.asking import World, asking
from rapp_nao_sim.world.frames import FRAMES, centre_of_mass, six, transform
from rapp_nao_sim.world.model import JOINTS, LINKS

_WHOLE = ("Body", "Joints", "Com")


class Frames(Module):
    """Spaces: 0 the torso's, 1 where the robot was first, 2 the robot's, on the floor between its feet; m and rad."""

    def __init__(self, world: World) -> None:
        self.__world = world

    @asking
    def getTransform(self, name: str, space: int, use_sensors: bool) -> list[float]:  # noqa: N802
        """A joint's, chain's, camera's or sensor's frame in a space: a 4x4 matrix, row by row."""
        matrix: Any = transform(name, space, self.__world.stance(bool(use_sensors)))
        return [float(value) for value in matrix.flat]

    @asking
    def getPosition(self, name: str, space: int, use_sensors: bool) -> list[float]:  # noqa: N802
        """The same as x, y, z, wx, wy, wz; the rotation is Rz(wz) Ry(wy) Rx(wx)."""
        return six(transform(name, space, self.__world.stance(bool(use_sensors))))

    @asking
    def getSensorNames(self) -> list[str]:  # noqa: N802
        """The frames that there are beside joints."""
        return list(FRAMES)

    @asking
    def getMass(self, name: str) -> float:  # noqa: N802
        """kg of the whole robot ("Body", "Joints", "Com"), of the Torso, or of what a joint or a chain's joints move."""
        return sum(LINKS[link].mass for link in _links(name))

    @asking
    def getCOM(self, name: str, space: int, use_sensors: bool) -> list[float]:  # noqa: N802
        """x, y, z in a space of the centre of mass of what getMass weighs."""
        return centre_of_mass(_links(name), space, self.__world.stance(bool(use_sensors)))


def _links(name: str) -> list[str]:
    if name in _WHOLE:
        return list(LINKS)
    return ["torso"] if name == "Torso" else [JOINTS[joint].child for joint in joints(name)]
