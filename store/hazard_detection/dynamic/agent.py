"""Looks whether the flat is safe (paper section VI: people with mild dementia forget open doors and lights).

The robot finds out where it is by the codes on the walls, walks to the door and to the lamp, and takes pictures; its cloud agent
judges them. What is not sure is looked at again from another side. What is wrong is said, and written to the carer if asked.
"""

import logging
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from place import Sight, codes_of, locate, sight

from rapp_api import (
    Behaviour,
    DynamicAgent,
    Edge,
    Machine,
    Pose,
    RappError,
    Refused,
    Subsystem,
    cloud,
    communication,
    keepsakes,
    navigation,
    vision,
)

_log = logging.getLogger(__name__)
Image = NDArray[np.uint8]
Point = tuple[float, float, float]

AROUND = (0.0, 0.9, 1.8, -0.9, -1.8)  # rad of the neck, that show together nearly everything round the robot
BETWEEN = (0.45, 1.35, -0.45, -1.35)
SWEEPS = ((0.0, AROUND, -0.1), (0.0, BETWEEN, 0.05), (math.pi / 2, AROUND, 0.0))
"""To find codes until there are enough: rad that the robot turns first, yaws and pitch of its head. Small ones may be missed."""
NEEDED = 2  # codes: a single one says little of the side from which it is seen
SIDEWAYS = 1.5  # rad to which the head alone turns
TRIES = 3  # of a picture: a camera that has slept may be late
QUALITY = 92  # of JPEG
CALL = 60.0  # s that the cloud agent may take
AWAY = "I cannot reach my cloud agent, so I cannot tell whether everything is safe"
YES, NO = "yes", "no"


def say(text: str) -> None:
    """Say it, and go on when it has been said."""
    communication.text_to_speech(text)


class _AwayError(Exception):
    """The cloud agent does not answer."""


class HazardDetection(DynamicAgent):
    """The dynamic agent; its task is an FSM."""

    def __init__(self, parameters: dict[str, Any] | None = None) -> None:
        super().__init__(parameters)
        self._codes = codes_of(self.parameters["codes"])
        self._looks: dict[str, Point] = self.parameters["looks"]  # of each place what to look at, in the map
        self._stands = {name: list(stands) for name, stands in self.parameters["stands"].items()}  # where to stand, one by one
        self._ahead = list(self._looks)  # where to look yet
        self._pictures: dict[str, Path] = {}
        self._found: dict[str, dict[str, Any]] = {}
        self._folder = Path(tempfile.mkdtemp(prefix="hazard-"))

    def task(self) -> Machine:
        """Where am I, place after place, judge, tell, write."""
        states = {
            "s31": Behaviour("s31", lambda _share: say("I look whether everything is safe"), label="say: I look"),
            "s32": Behaviour("s32", self._find_itself, label="find out where it is"),
            "s33": Behaviour("s33", self._walk, label="walk to the next place"),
            "s34": Behaviour("s34", self._look, label="look, and take a picture"),
            "s35": Behaviour("s35", self._judge, label="ask the cloud agent"),
            "s36": Behaviour("s36", lambda _share: say("I am not sure, I look again"), label="say: I look again"),
            "s37": Behaviour("s37", self._tell, label="say what it has found"),
            "s38": Behaviour("s38", self._offer_mail, label="write to the carer if asked"),
            "away": Behaviour("away", lambda _share: say(AWAY), label="say that the cloud agent is away"),
            "lost": Behaviour("lost", self._say_lost, label="say that it does not know where it is"),
            "end": Behaviour("end", lambda _share: navigation.rest(), label="rest"),
        }
        edges = [
            Edge("s31", "s32"),
            Edge("s32", "away", _away, "no cloud agent"),
            Edge("s32", "lost", lambda share: not share.memory["known"], "too few codes"),
            Edge("s32", "s33"),
            Edge("s33", "s34"),
            Edge("s34", "s33", lambda _share: bool(self._ahead), "next place"),
            Edge("s34", "s35"),
            Edge("s35", "away", _away, "no cloud agent"),
            Edge("s35", "s36", lambda _share: bool(self._again()), "not sure"),
            Edge("s35", "s37"),
            Edge("s36", "s33"),
            Edge("s37", "s38", lambda _share: self._worth_a_mail, "not all is safe"),
            Edge("s37", "end", label="all is safe"),
            Edge("s38", "end"),
            Edge("away", "end"),
            Edge("lost", "end"),
        ]
        return Machine("hazard_detection", states, "s31", edges, ["end"], label="execute")

    # where it is

    def _find_itself(self, share: Subsystem) -> None:
        share.memory["away"] = False
        sights: dict[str, Sight] = {}
        navigation.take_predefined_posture("StandInit")
        try:
            for turn, yaws, pitch in SWEEPS:
                if len(sights) < NEEDED:
                    self._sweep(turn, yaws, pitch, sights)
        except _AwayError as error:
            _log.error("%s", error)
            share.memory["away"] = True
            return
        pose = locate(list(sights.values())) if len(sights) >= NEEDED else None
        share.memory["known"] = pose is not None
        _log.info("codes seen: %s; the robot is at %s", ", ".join(sights) or "none", pose)
        if pose is not None:
            navigation.set_global_pose(pose)

    def _sweep(self, turn: float, yaws: Sequence[float], pitch: float, sights: dict[str, Sight]) -> None:
        if turn:
            sights.clear()  # they were seen from another side
            try:
                navigation.move_to(0.0, 0.0, turn)
            except Refused as error:
                _log.info("%s", error)
        for yaw in yaws:
            self._look_for_codes(yaw, pitch, sights)

    def _look_for_codes(self, yaw: float, pitch: float, sights: dict[str, Sight]) -> None:
        navigation.move_joint(["HeadYaw", "HeadPitch"], [yaw, pitch])
        picture = _taken(vision.QUAD_VGA)
        if picture is None:
            return
        camera = navigation.get_transform("CameraTop", navigation.ROBOT)
        try:
            found = cloud.call_agent_wait("find_codes", {"picture": self._written("around", picture)}, CALL)
        except RappError as error:
            raise _AwayError(str(error)) from error
        size = (picture.shape[1], picture.shape[0])
        for code in found["codes"]:
            if code["text"] in self._codes:
                sights[code["text"]] = sight(self._codes[code["text"]], code["corners"], size, camera)

    def _say_lost(self, _share: Subsystem) -> None:
        say("I do not know where I am, please put me where I see the codes on the walls, and ask again")

    # place after place

    def _walk(self, _share: Subsystem) -> None:
        name = self._ahead[0]
        x, y = self._stands[name].pop(0)
        look = self._looks[name]
        say(f"I go to the {name}")
        try:
            navigation.move_along_path([Pose(x, y, math.atan2(look[1] - y, look[0] - x))])
        except Refused as error:
            _log.info("%s", error)
            say(f"something is in my way, I cannot get to the {name}, I look from here")

    def _look(self, _share: Subsystem) -> None:
        name = self._ahead.pop(0)
        point = self._looks[name]
        x, y, z = _seen_from(navigation.get_robot_pose(), point)
        side = math.atan2(y, x)
        try:
            if abs(side) > SIDEWAYS:
                navigation.move_to(0.0, 0.0, side)
                x, y, z = _seen_from(navigation.get_robot_pose(), point)
            navigation.look_at_point(x, y, z)
        except Refused as error:
            _log.info("%s", error)  # what it sees then is judged like any other picture
        picture = _taken(vision.VGA)
        if picture is None:
            say(f"I cannot take a picture of the {name}")
            return
        self._pictures[name] = self._written(name, picture)
        keepsakes.keep(f"{name}.jpg", self._pictures[name].read_bytes())

    def _judge(self, share: Subsystem) -> None:
        share.memory["away"] = False
        if len(self._pictures) < len(self._stands):
            self._found = {name: {"sure": False, "words": f"I have no picture of the {name}"} for name in self._stands}
        else:
            try:
                self._found = cloud.call_agent_wait("check", dict(self._pictures), CALL)
            except RappError as error:
                _log.error("%s", error)
                share.memory["away"] = True
                return
        self._ahead = self._again()

    def _again(self) -> list[str]:
        """What is not sure, and may be looked at from another side."""
        return [name for name, stands in self._stands.items() if stands and not self._found[name]["sure"]]

    # telling

    def _tell(self, _share: Subsystem) -> None:
        say(self._answer())

    def _answer(self) -> str:
        words = ", and ".join(found["words"] for found in self._found.values())
        if not all(found["sure"] for found in self._found.values()):
            return f"{words}; please look yourself"
        return f"{words}; please see to it" if self._worth_a_mail else f"everything is safe, {words}"

    @property
    def _worth_a_mail(self) -> bool:
        return not all(found["sure"] and not found["hazard"] for found in self._found.values())

    def _offer_mail(self, _share: Subsystem) -> None:
        try:
            profile = cloud.call_wait("profile")
        except RappError as error:
            _log.error("%s", error)
            say("I cannot write to anybody, because I cannot reach the platform")
            return
        if not profile["contacts"]:
            return
        carer = profile["contacts"][0]
        say(f"shall I write to {carer['name']}? please say {YES} or {NO}")
        if communication.word_spotting([YES, NO]) != YES:
            say("I write to nobody")
            return
        body = f"I looked whether everything is safe in the flat of {profile['name']}: {self._answer()}."
        self._send(carer, f"From the robot of {profile['name']}: is everything safe?", body)

    def _send(self, carer: dict[str, str], subject: str, body: str) -> None:
        try:
            state = cloud.send_mail_wait([carer["address"]], subject, body)
        except RappError as error:
            _log.error("%s", error)
            say(f"I could not write to {carer['name']}")
            return
        words = {"delivered": "I have written to {}", "unknown": "I do not know whether my message to {} is sent"}
        say(words.get(state, "I write to {} later").format(carer["name"]))

    def _written(self, name: str, picture: Image) -> Path:
        path = self._folder / f"{name}.jpg"
        path.write_bytes(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes())
        return path


def _away(share: Subsystem) -> bool:
    return bool(share.memory["away"])


def _taken(resolution: int) -> Image | None:
    """A picture of the top camera, if it gives one."""
    for _ in range(TRIES):
        picture = vision.capture_image("top", resolution)
        if picture.size:
            return picture
    return None


def _seen_from(pose: Pose, point: Point) -> Point:
    """A point of the map in the frame of a robot at a pose; the height stays."""
    x, y = point[0] - pose.x, point[1] - pose.y
    cos, sin = math.cos(pose.theta), math.sin(pose.theta)
    return (cos * x + sin * y, cos * y - sin * x, point[2])
