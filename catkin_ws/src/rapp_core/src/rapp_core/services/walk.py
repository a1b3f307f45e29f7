"""rapp_move_to and rapp_move_along_path: moveTo and moveAlongPath of the deliverable (section 4.5.2)."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rapp_agent import Behaviour, Edge, Machine, Subsystem
from rapp_core.body_ports import Movement, Pose2D
from rapp_core.errors import Invalid, Refused
from rapp_core.geometry import finite, relative, turned
from rapp_core.services.context import Context, request
from rapp_core.services.moving import FEELING, Every, motion, refuse_hazard, refuse_what_ended, standing_up
from rapp_core.services.place import FRAMES, Waypoint

MOST = 100  # poses of a path
TURN_FIRST = math.radians(20)  # rad to the side of a pose above which the robot turns before it walks there
NEARLY = 0.05  # m before a goal from where what is left says no more in which direction the robot walks
ON_THE_SPOT = Pose2D(0.0, 0.0, 0.0)
THERE = 0.1  # m from a pose within which it is not turned to


class _Walk:
    """Legs of a walk, one after another; start, goals and poses are in odom."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._motion = context.robot.motion
        self._feeling = Every(context, FEELING)
        self._start = self._pose = self._goal = self._way = ON_THE_SPOT
        self._goals: list[Pose2D] = []
        self._reached = 0

    def plan(self, waypoints: Sequence[Waypoint], turns: bool) -> None:
        """Where to walk, from where the robot is; `turns`: towards a goal before it walks there. Raises Refused."""
        context, start = self._context, self._motion.pose()
        self._start = self._pose = start
        self._goals = [context.place.in_odom(waypoint, start) for waypoint in waypoints]
        _refuse_far(context, itertools.pairwise([start, *self._goals]))
        self._goal = self._goals[0]
        way = self.left()
        self._way = ON_THE_SPOT if turns and self._askew(way) else way
        refuse_hazard(context, self._way)

    def left(self) -> Pose2D:
        """What is left of the way to the present goal, in base_link."""
        return relative(self._pose, self._goal)

    def stands(self, _share: Subsystem) -> bool:
        """Whether the robot can walk as it is."""
        return self._motion.standing()

    def next(self, _share: Subsystem) -> None:
        """Turn to the next goal."""
        self._pose, self._goal = self._motion.pose(), self._goals[self._reached]

    def askew(self, _share: Subsystem) -> bool:
        """Whether the robot has to turn before it walks on."""
        return self._askew(self.left())

    @staticmethod
    def _askew(way: Pose2D) -> bool:
        return math.hypot(way.x, way.y) > THERE and abs(math.atan2(way.y, way.x)) > TURN_FIRST

    def turn(self, _share: Subsystem) -> Movement:
        """Turn towards the goal."""
        way = self.left()
        self._way = ON_THE_SPOT
        return self._walk(Pose2D(0.0, 0.0, math.atan2(way.y, way.x)))

    def walk(self, _share: Subsystem) -> Movement:
        """Walk to the goal."""
        self._pose = self._motion.pose()
        left = self.left()
        self._way = left if _tells(left) else self._planned()
        return self._walk(left)

    def _planned(self) -> Pose2D:
        """The way to the present goal from where the robot was to be before."""
        return relative(self._goals[self._reached - 1] if self._reached else self._start, self._goal)

    def _walk(self, way: Pose2D) -> Movement:
        self._context.trace.call("core", "ALMotion", "moveTo")
        return self._motion.move_to(way.x, way.y, way.theta)

    def watch(self, _share: Subsystem) -> None:
        """The robot's reflexes on its way to the goal."""
        if self._feeling.due():
            self._pose = self._motion.pose()
            left = self.left()
            if self._way != ON_THE_SPOT and _tells(left):
                self._way = left
            refuse_hazard(self._context, self._way)

    def explain(self, _share: Subsystem) -> None:
        """Why a robot may have ended its walk by itself. Raises Refused."""
        refuse_what_ended(self._context, self._way)

    def arrive(self, _share: Subsystem) -> None:
        """Judge where the robot has come to. Raises Refused."""
        config = self._context.config
        self._pose = self._motion.pose()
        left = self.left()
        distance = math.hypot(left.x, left.y)
        if distance > config.walk_error or abs(left.theta) > config.turn_error:
            refuse_hazard(self._context, self._way)
            off = f"{distance:.2f} m and {abs(left.theta):.2f} rad before the goal"
            raise Refused(f"cannot get there: the robot has stopped {off}; see what is in its way, and try again")
        self._reached += 1

    def more(self, _share: Subsystem) -> bool:
        """Whether there are goals left."""
        return self._reached < len(self._goals)

    def from_start(self, _share: Subsystem) -> Mapping[str, Any]:
        """Feedback of rapp_move_to."""
        now = relative(self._start, self._pose)
        return {"x": now.x, "y": now.y, "theta": now.theta}

    def on_path(self, _share: Subsystem) -> Mapping[str, Any]:
        """Feedback of rapp_move_along_path."""
        return {"reached": self._reached, "pose": self._context.place.in_map(self._pose)}


def _tells(left: Pose2D) -> bool:
    """Whether what is left of a way tells in which direction the robot walks."""
    return math.hypot(left.x, left.y) > NEARLY


def _refuse_far(context: Context, legs: Iterable[tuple[Pose2D, Pose2D]]) -> None:
    length = sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in legs)
    if length > context.config.walk_distance:
        most = f"{context.config.walk_distance:g} m at a time are allowed; walk in parts"
        raise Refused(f"cannot walk {length:.1f} m: {most}")


def check(context: Context, share: Subsystem) -> None:
    """Whether a request of rapp_move_to is of use, wherever the robot is. Raises Invalid, Refused."""
    x, y, theta = (float(request(share, name)) for name in ("x", "y", "theta"))
    if not finite(x, y, theta):
        raise Invalid("cannot walk there: x, y and theta must be numbers; m and rad")
    # The way round is the same pose: NAOqi would turn on the spot for a theta of many turns.
    goal = share.memory["goal"] = Pose2D(x, y, turned(theta))
    _refuse_far(context, [(ON_THE_SPOT, goal)])


def machine(context: Context) -> Machine:
    """Sub-FSM: check, stand up if need be, walk, judge."""
    do = _Walk(context)

    def plan(share: Subsystem) -> None:
        check(context, share)
        goal: Any = share.memory["goal"]
        do.plan([Waypoint("base_link", goal)], turns=False)

    return Machine(
        "rapp_move_to",
        {
            "check": Behaviour("check", plan, label="check"),
            "stand": standing_up(context),
            "walk": motion(context, "walk", do.walk, "moveTo", watch=do.watch, feedback=do.from_start, explain=do.explain),
            "arrived": Behaviour("arrived", do.arrive, label="judge"),
        },
        "check",
        [Edge("check", "walk", do.stands, "stands"), Edge("check", "stand"), Edge("stand", "walk"), Edge("walk", "arrived")],
        ["arrived"],
    )


def check_path(context: Context, share: Subsystem) -> None:
    """Whether a request of rapp_move_along_path is of use, wherever the robot is. Raises Invalid, Refused."""
    poses: Sequence[Waypoint] = request(share, "poses")
    if not 1 <= len(poses) <= MOST:
        raise Invalid(f"cannot walk along {len(poses)} poses: 1 to {MOST} are possible")
    for number, waypoint in enumerate(poses, 1):
        if waypoint.frame not in FRAMES:
            raise Invalid(f"cannot use pose {number} in frame {waypoint.frame!r}: known are {', '.join(FRAMES)}")
        if not finite(waypoint.pose.x, waypoint.pose.y, waypoint.pose.theta):
            raise Invalid(f"cannot use pose {number}: its position and orientation must be numbers")
    legs = itertools.pairwise([Waypoint("base_link", ON_THE_SPOT), *poses])
    _refuse_far(context, [(a.pose, b.pose) for a, b in legs if a.frame == b.frame])


def path_machine(context: Context) -> Machine:
    """Sub-FSM: check, stand up if need be, then for each pose: turn towards it if need be, walk, judge."""
    do = _Walk(context)

    def plan(share: Subsystem) -> None:
        check_path(context, share)
        do.plan(request(share, "poses"), turns=True)

    return Machine(
        "rapp_move_along_path",
        {
            "check": Behaviour("check", plan, label="check"),
            "stand": standing_up(context),
            "next": Behaviour("next", do.next, label="next pose"),
            "turn": motion(context, "turn", do.turn, "moveTo", watch=do.watch, feedback=do.on_path, explain=do.explain),
            "walk": motion(context, "walk", do.walk, "moveTo", watch=do.watch, feedback=do.on_path, explain=do.explain),
            "judge": Behaviour("judge", do.arrive, label="judge"),
            "arrived": Behaviour("arrived", lambda _share: None, label="arrived"),
        },
        "check",
        [
            Edge("check", "next", do.stands, "stands"),
            Edge("check", "stand"),
            Edge("stand", "next"),
            Edge("next", "turn", do.askew, "looks elsewhere"),
            Edge("next", "walk"),
            Edge("turn", "walk"),
            Edge("walk", "judge"),
            Edge("judge", "next", do.more, "more poses"),
            Edge("judge", "arrived"),
        ],
        ["arrived"],
    )
