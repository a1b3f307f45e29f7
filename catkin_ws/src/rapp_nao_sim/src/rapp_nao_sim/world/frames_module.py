"""The half of ALMotion that tells where the body's parts are, after NAOqi 2.1."""

from typing import Any

from rapp_nao_sim.naoqi import Module
from rapp_nao_sim.world.asking import World, asking
from rapp_nao_sim.world.frames import FRAMES, six, transform


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
