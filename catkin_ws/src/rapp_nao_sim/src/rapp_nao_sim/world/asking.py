"""What the modules of the body have in common: the world they ask, off libqi's threads, and how its errors are told."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from rapp_nao_sim.naoqi import NaoqiError, named, working
from rapp_nao_sim.world.errors import WorldError
from rapp_nao_sim.world.frames import Stance

Ways = Sequence[Sequence[float]]  # for each joint, its values one after another


class World(Protocol):
    """What the modules need of WorldClient."""

    def robot_pose(self) -> tuple[float, float, float]: ...  # noqa: D102 - as WorldClient
    def velocity(self) -> tuple[float, float, float]: ...  # noqa: D102
    def joint_angles(self, names: Sequence[str]) -> list[float]: ...  # noqa: D102
    def commanded_angles(self, names: Sequence[str]) -> list[float]: ...  # noqa: D102
    def stiffnesses(self, names: Sequence[str]) -> list[float]: ...  # noqa: D102
    def set_stiffness(self, names: Sequence[str], values: Sequence[float]) -> None: ...  # noqa: D102
    def set_joints(self, names: Sequence[str], angles: Sequence[float], fraction: float) -> None: ...  # noqa: D102
    def move_joints(self, names: Sequence[str], angles: Ways, times: Ways) -> bool: ...  # noqa: D102
    def set_posture(self, name: str, speed: float) -> bool: ...  # noqa: D102
    def posture(self) -> tuple[str, str]: ...  # noqa: D102
    def wake_up(self) -> bool: ...  # noqa: D102
    def rest(self) -> bool: ...  # noqa: D102
    def awake(self) -> bool: ...  # noqa: D102
    def walk_to(self, points: Ways, share: float, lift: float) -> bool: ...  # noqa: D102
    def walk_at(self, velocity: Sequence[float], share: float, lift: float) -> None: ...  # noqa: D102
    def walking(self) -> bool: ...  # noqa: D102
    def wait_for_walk(self, seconds: float) -> None: ...  # noqa: D102
    def stop_walk(self) -> None: ...  # noqa: D102
    def swing_arms(self, left: bool, right: bool) -> None: ...  # noqa: D102
    def odometry(self, use_sensors: bool) -> tuple[float, float, float]: ...  # noqa: D102
    def stance(self, use_sensors: bool) -> Stance: ...  # noqa: D102
    def next_pose(self) -> tuple[float, float, float]: ...  # noqa: D102
    def stop_joints(self, names: Sequence[str]) -> None: ...  # noqa: D102
    def tasks(self) -> list[tuple[str, int, list[str]]]: ...  # noqa: D102
    def busy(self, names: Sequence[str]) -> bool: ...  # noqa: D102
    def protect(self, side: str, on: bool) -> None: ...  # noqa: D102
    def guard(self, what: str, on: bool) -> None: ...  # noqa: D102
    def stop_posture(self) -> None: ...  # noqa: D102
    def stop(self) -> None: ...  # noqa: D102
    def is_moving(self) -> bool: ...  # noqa: D102


def asking(method: Callable[..., Any]) -> Callable[..., Any]:
    """A module's method that asks the world: off libqi's threads, the world's errors told as NAOqi's."""

    def call(self: Any, *args: Any) -> Any:
        try:
            return method(self, *args)
        except (WorldError, ValueError) as error:
            raise NaoqiError(str(error)) from error

    return working(named(call, method))
