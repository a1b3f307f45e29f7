"""ALTracker over the world, after NAOqi 2.1: looking at points."""

from typing import Any

import numpy as np
import qi

from rapp_nao_sim.naoqi import Module, NaoqiError
from rapp_nao_sim.world.arguments import number
from rapp_nao_sim.world.asking import World, asking
from rapp_nao_sim.world.frames import TORSO, gaze, transform
from rapp_nao_sim.world.model import JOINTS
from rapp_nao_sim.world.moves import clip

SHORTEST = 0.05  # s of turning the head


@qi.multiThreaded()
class ALTracker(Module):
    """Turns the head."""

    def __init__(self, world: World) -> None:
        self.__world = world

    @asking
    def lookAt(self, position: Any, *rest: Any) -> bool:  # noqa: N802
        """Turn the top camera to a point (x, y, z in m) of a frame (0 torso, 1 world, 2 robot), and wait.

        lookAt(position, frame, fraction of the greatest speed, use of the whole body), or without the frame: the torso's. The
        body does not help; a head that cannot turn so far turns as far as it can. Gives whether the point is looked at.
        """
        frame, fraction = (rest[0], rest[1]) if len(rest) == 3 else (TORSO, rest[0] if rest else None)
        if not isinstance(position, list | tuple) or len(position) != 3 or len(rest) not in (2, 3):
            raise NaoqiError("cannot look: give [x, y, z], frame, fraction of the speed, whether to use the whole body")
        point, share = np.array([number(part) for part in position] + [1.0]), number(fraction)
        if not 0 < share <= 1:
            raise NaoqiError("cannot look: the fraction of the greatest speed must be above 0 and at most 1")
        torso = transform("Torso", frame, self.__world.stance(True))
        wanted = dict(zip(("HeadYaw", "HeadPitch"), gaze((np.linalg.inv(torso) @ point)[:3].tolist()), strict=True))
        goals = {name: clip(name, angle) for name, angle in wanted.items()}
        now = self.__world.commanded_angles(list(goals))
        seconds = max(abs(goal - start) / JOINTS[name].speed for (name, goal), start in zip(goals.items(), now, strict=True))
        times = [[max(SHORTEST, seconds / share)]] * len(goals)
        return self.__world.move_joints(list(goals), [[goal] for goal in goals.values()], times) and goals == wanted

    @asking
    def stopTracker(self) -> None:  # noqa: N802
        """Let the head be."""
        self.__world.stop_joints(["HeadYaw", "HeadPitch"])
