"""The part of ALMotion that switches the robot's reflexes, after NAOqi 2.1."""

from typing import Any

from rapp_nao_sim.naoqi import Module, NaoqiError
from rapp_nao_sim.world.asking import World, asking
from rapp_nao_sim.world.legs import SIDES

_ARMS = {"LArm": "L", "RArm": "R"}
_EXTERNAL = ("All", "Move", "Arms", "LArm", "RArm")


class Reflexes(Module):
    """What the robot does by itself; all is on at the start."""

    def __init__(self, world: World) -> None:
        self.__world = world

    @asking
    def setFallManagerEnabled(self, on: bool) -> None:  # noqa: N802
        """Whether the stiffness goes when the robot falls."""
        self.__world.guard("falls", bool(on))

    @asking
    def setExternalCollisionProtectionEnabled(self, name: str, on: bool) -> None:  # noqa: N802
        """Whether a walk ("Move" or "All") ends when a bumper is pressed; the arms feel nothing outside."""
        if name not in _EXTERNAL:
            raise NaoqiError(f"cannot protect {name!r}: known are {', '.join(_EXTERNAL)}")
        if name in ("All", "Move"):
            self.__world.guard("bumpers", bool(on))

    @asking
    def setCollisionProtectionEnabled(self, name: str, on: bool) -> bool:  # noqa: N802
        """Whether an arm ("LArm", "RArm" or "Arms") is kept out of the body; gives whether it was done."""
        sides = SIDES if name == "Arms" else _ARMS.get(name, "")
        if not sides:
            raise NaoqiError(f"cannot protect {name!r}: known are Arms, {', '.join(_ARMS)}")
        for side in sides:
            self.__world.protect(side, bool(on))
        return True

    def setSmartStiffnessEnabled(self, _on: bool) -> None:  # noqa: N802
        """Accepted: these motors do not get warm."""

    def setBreathEnabled(self, _chain: str, _on: bool) -> None:  # noqa: N802
        """Accepted: this robot does not sway when it is idle."""

    def setIdlePostureEnabled(self, _chain: str, _on: bool) -> None:  # noqa: N802
        """Accepted: this robot does not move when it is idle."""

    def setMotionConfig(self, _config: list[list[Any]]) -> None:  # noqa: N802
        """Accepted: what it switches (contact of the feet, the use of gyroscopes) is not part of this robot."""
