"""Shows a person around the room: walks to its places, looks at each, takes a picture, comes back and rests.

What the robot's reflexes stop it for is gone round, on one side or the other, or the place is given up. The pictures and a top
view of the path are left with `keepsakes`.
"""

import logging
import math
from typing import Any

import cv2
from drawing import draw
from room import Place, Point, Room, along, seen_from
from track import Track, beside

from rapp_api import Behaviour, DynamicAgent, Edge, Machine, Pose, Refused, Subsystem, communication, keepsakes, navigation, vision

_log = logging.getLogger(__name__)
SIDEWAYS = 1.5  # rad to which the head alone turns
TRIES = 3  # of a picture: a camera that has slept may be late
SWITCHED_ON = 0.02  # m or rad from the map's origin: nobody has told where it is, and the robot has not walked


def say(text: str) -> None:
    """Say it, and go on when it has been said."""
    communication.text_to_speech(text)


class ShowAround(DynamicAgent):
    """The dynamic agent; its task is an FSM."""

    def __init__(self, parameters: dict[str, Any] | None = None) -> None:
        super().__init__(parameters)
        self._room = Room(self.parameters)
        self._track = Track()
        self._ahead: list[Place | None] = [*self._room.places, None]  # where to go yet; None is back
        self._way: list[Point] = []  # to the next of them
        self._saying = ""  # on the way
        self._ways: list[list[Point]] | None = None  # round what is in the way; None: nothing was yet
        self._seen: list[Place] = []  # those with a picture
        self._stops: list[Pose] = []  # where something was in the way
        self._back = False

    def initialise(self) -> None:
        """Know where in the room the robot is: where it was switched on, if nobody has told."""
        pose = navigation.get_robot_pose()
        if max(abs(pose.x), abs(pose.y), abs(pose.theta)) < SWITCHED_ON:
            navigation.set_global_pose(self._room.home)
        self._start = self._track.note()

    def task(self) -> Machine:
        """Place after place, then back."""
        states = {
            "s31": Behaviour("s31", lambda _share: say("I show you around"), label="say: I show you around"),
            "s32": Behaviour("s32", self._choose, label="choose where to go"),
            "s33": Behaviour("s33", self._walk, label="say it, and walk there"),
            "s34": Behaviour("s34", self._go_round, label="find a way round"),
            "s35": Behaviour("s35", self._give_up, label="say that it is given up"),
            "s36": Behaviour("s36", self._look, label="look, and take a picture"),
            "s37": Behaviour("s37", self._keep_path, label="draw the path"),
            "end": Behaviour("end", self._end, label="say how it ended"),
        }
        edges = [
            Edge("s31", "s32"),
            Edge("s32", "s33"),
            Edge("s33", "s34", lambda share: bool(share.memory["stopped"] and self._ways), "in the way"),
            Edge("s33", "s35", lambda share: bool(share.memory["stopped"]), "no way round"),
            Edge("s33", "s37", lambda _share: self._ahead[0] is None, "back"),
            Edge("s33", "s36", label="there"),
            Edge("s34", "s33"),
            Edge("s35", "s37", lambda _share: self._ahead[0] is None, "on the way back"),
            Edge("s35", "s36", label="look from here"),
            Edge("s36", "s32"),
            Edge("s37", "end"),
        ]
        return Machine("show_around", states, "s31", edges, ["end"], label="execute")

    def _choose(self, _share: Subsystem) -> None:
        place = self._ahead[0]
        self._saying = "I go back" if place is None else f"I go to the {place.name}"
        self._way, self._ways = [self._goal], None

    @property
    def _goal(self) -> Point:
        place = self._ahead[0]
        return (self._start.x, self._start.y) if place is None else place.stand

    def _walk(self, share: Subsystem) -> None:
        here = self._track.note()
        path = along((here.x, here.y), self._way)
        if self._ahead[0] is None:
            path[-1] = self._start
        share.memory["stopped"] = False
        try:
            with beside(lambda: say(self._saying)), self._track.followed():
                navigation.move_along_path(path)
        except Refused as error:
            _log.info("%s", error)
            share.memory["stopped"] = True
            here = self._track.note()
            self._stops.append(here)
            if self._ways is None:
                self._ways = self._room.ways_round((here.x, here.y), self._goal)
        else:
            self._track.note()
            self._back = self._ahead[0] is None

    def _go_round(self, _share: Subsystem) -> None:
        assert self._ways
        self._way = self._ways.pop(0)
        self._saying = "something is in my way, I go round it"

    def _give_up(self, _share: Subsystem) -> None:
        place = self._ahead[0]
        where = "back" if place is None else f"to the {place.name}"
        say(f"something is in my way, I cannot get {where}")

    def _look(self, _share: Subsystem) -> None:
        place = self._ahead.pop(0)
        assert place is not None
        x, y, z = seen_from(self._track.note(), place.look)
        side = math.atan2(y, x)
        if abs(side) > SIDEWAYS:
            navigation.move_to(0.0, 0.0, side)
            x, y, z = seen_from(self._track.note(), place.look)
        navigation.look_at_point(x, y, z)
        for _ in range(TRIES):
            picture = vision.capture_image("top", vision.VGA)
            if picture.size:
                break
        else:
            say(f"I cannot take a picture of the {place.name}")
            return
        keepsakes.keep(place.name.replace(" ", "-") + ".jpg", cv2.imencode(".jpg", picture)[1].tobytes())
        self._seen.append(place)
        say(f"this is the {place.name}")

    def _keep_path(self, _share: Subsystem) -> None:
        sheet = draw(self._room, self._track.poses, self._seen, self._stops)
        keepsakes.keep("path.png", cv2.imencode(".png", sheet)[1].tobytes())

    def _end(self, _share: Subsystem) -> None:
        begin = "I am back" if self._back else "I am not back, please help me"
        number = len(self._seen)
        say(f"{begin}, I have kept {number} picture{'s' if number != 1 else ''} and my path")

    def terminate(self) -> None:
        """Rest, however it went."""
        navigation.rest()
