"""The walking half of ALMotion, after NAOqi 2.1."""

from typing import Any

from rapp_nao_sim.naoqi import NaoqiError
from rapp_nao_sim.world.arguments import number
from rapp_nao_sim.world.asking import World, asking
from rapp_nao_sim.world.frames_module import Frames
from rapp_nao_sim.world.walk import FASTEST

# Name: default, least, greatest; lengths in m, angles in rad, the frequency as a share.
CONFIG = {
    "MaxStepX": (0.04, 0.001, 0.08),
    "MaxStepY": (0.14, 0.101, 0.16),
    "MaxStepTheta": (0.349, 0.001, 0.524),
    "MaxStepFrequency": (1.0, 0.0, 1.0),
    "StepHeight": (0.02, 0.005, 0.04),
    "TorsoWx": (0.0, -0.122, 0.122),
    "TorsoWy": (0.0, -0.122, 0.122),
}
SLOWEST = 0.1  # share of full speed
LONGEST = 600.0  # s of waiting for the end of a walk
_INIT_SPEED = 0.6


class Walking(Frames):
    """Walks over the floor; m, rad, s. A new command replaces the one under way."""

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self.__world = world

    @asking
    def moveInit(self) -> None:  # noqa: N802
        """Take the posture that walks begin with, and wait."""
        if not self.__world.walking():
            self.__world.set_posture("StandInit", _INIT_SPEED)

    @asking
    def moveTo(self, *args: Any) -> bool:  # noqa: N802
        """Walk to a pose (x, y, theta) seen from the robot, or through a list of poses, and wait; gives whether it is there.

        A list of [name, value] may follow, see getMoveConfig.
        """
        if args and isinstance(args[0], list | tuple):
            points, rest = [_three(point) for point in args[0]], args[1:]
        else:
            points, rest = [_three(args[:3])], args[3:]
        return self.__world.walk_to(points, *_settings(rest))

    @asking
    def move(self, *args: Any) -> None:
        """Walk at a velocity (m/s ahead, m/s to the left, rad/s) until told otherwise; does not wait. [name, value] may follow."""
        self.__world.walk_at(_three(args[:3]), *_settings(args[3:]))

    @asking
    def moveToward(self, *args: Any) -> None:  # noqa: N802
        """As move, each part a share (-1 to 1) of the greatest velocity."""
        shares = _three(args[:3])
        if max(map(abs, shares)) > 1:
            raise NaoqiError("cannot walk faster than at full speed; give shares from -1 to 1")
        velocity = [share * fastest for share, fastest in zip(shares, FASTEST, strict=True)]
        self.__world.walk_at(velocity, *_settings(args[3:]))

    @asking
    def stopMove(self) -> None:  # noqa: N802
        """Come to stand at once."""
        self.__world.stop_walk()

    @asking
    def killMove(self) -> None:  # noqa: N802
        """As stopMove."""
        self.__world.stop_walk()

    @asking
    def moveIsActive(self) -> bool:  # noqa: N802
        """Whether the robot walks."""
        return self.__world.walking()

    @asking
    def waitUntilMoveIsFinished(self) -> None:  # noqa: N802
        """Wait until the robot does not walk."""
        self.__world.wait_for_walk(LONGEST)

    @asking
    def getMoveConfig(self, which: str) -> list[list[Any]]:  # noqa: N802
        """The settings of the walk: "Default", "Min" or "Max". Smaller steps, or fewer, make it slower."""
        columns = {"Default": 0, "Min": 1, "Max": 2}
        if which not in columns:
            raise NaoqiError(f"cannot find settings {which!r}: known are {', '.join(columns)}")
        return [[name, values[columns[which]]] for name, values in CONFIG.items()]

    @asking
    def getRobotPosition(self, use_sensors: bool) -> list[float]:  # noqa: N802
        """x, y and theta in the frame where the robot was first, as the legs' sensors, or their commands, tell."""
        return list(self.__world.odometry(bool(use_sensors)))

    @asking
    def getNextRobotPosition(self) -> list[float]:  # noqa: N802
        """Where the robot will be after its present step."""
        return list(self.__world.next_pose())

    @asking
    def getRobotVelocity(self) -> list[float]:  # noqa: N802
        """Speed ahead and to the left (m/s), turning (rad/s)."""
        return list(self.__world.velocity())

    @asking
    def setMoveArmsEnabled(self, left: bool, right: bool) -> None:  # noqa: N802
        """Whether the arms swing in walks."""
        self.__world.swing_arms(bool(left), bool(right))

    @asking
    def setWalkArmsEnabled(self, left: bool, right: bool) -> None:  # noqa: N802
        """As setMoveArmsEnabled."""
        self.__world.swing_arms(bool(left), bool(right))


def _three(values: Any) -> list[float]:
    if not isinstance(values, list | tuple) or len(values) != 3:
        raise NaoqiError(f"cannot walk to {values!r}: give x, y and theta")
    return [number(value) for value in values]


def _settings(rest: tuple[Any, ...]) -> tuple[float, float]:
    """Share of full speed, and the height that feet are lifted to."""
    values = {name: default for name, (default, _, _) in CONFIG.items()}
    for pair in rest[0] if rest else ():
        if not isinstance(pair, list | tuple) or len(pair) != 2 or pair[0] not in CONFIG:
            raise NaoqiError(f"cannot walk with {pair!r}: known are {', '.join(CONFIG)}, each as [name, value]")
        _, least, most = CONFIG[pair[0]]
        values[pair[0]] = min(most, max(least, number(pair[1])))
    shares = [values[name] / CONFIG[name][0] for name in ("MaxStepX", "MaxStepTheta", "MaxStepFrequency")]
    return max(SLOWEST, min(1.0, *shares)), values["StepHeight"]
