"""Every function of `rapp_api` that uses the robot, on the fake core agent for authors and on the simulated robot.

What holds for a RApp at its author's desk holds on the robot: the same answers, the same words refused, for the same reasons.
"""

import math
import re
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import numpy as np
import pytest

from fakes.far_rapp import FarRapp, goal
from fakes.lender import borrow, install_lender
from fakes.whole_robot import WholeRobot, whole_robot
from rapp_api import DynamicAgent, Invalid, Pose, RappError, Refused, communication, keepsakes, navigation, vision
from rapp_api.testing import FakeCoreAgent
from rapp_core.services.table import CORE_SERVICES

pytestmark = pytest.mark.timeout(180)
SETTINGS = "register_timeout = 0.5\nheartbeat = 10.0\n"  # a busy machine may keep the lender from its turns
NAN, INF = math.nan, math.inf
PATIENCE = 60.0  # s

pause = DynamicAgent().pause


class Desk:
    """The fake core agent, and a person who answers at once."""

    def __init__(self) -> None:
        self._core = FakeCoreAgent().__enter__()

    def call(self, function: Callable[..., Any], *args: Any) -> Any:
        return function(*args)

    def hears(self, word: str, function: Callable[..., Any], *args: Any) -> Any:
        """Call what listens, while a person says a word."""
        self._core._hears.append(word)
        return function(*args)

    def rests(self) -> tuple[str, bool]:
        """The family of its posture, and whether its motors are on; it has none, but knows when it would need them."""
        family = {"Sit": "Sitting", "StandInit": "Standing"}[self._core.posture]
        return family, family == "Standing"

    def close(self) -> None:
        self._core.__exit__()


class Robot:
    """The simulated robot and its core agent, and a person who says a word until it is heard."""

    def __init__(self, robot: WholeRobot) -> None:
        self._robot = robot
        self._rapp = FarRapp(robot.ros, borrow(robot))

    def call(self, function: Callable[..., Any], *args: Any) -> Any:
        return self._rapp.call(function, *args)

    def hears(self, word: str, function: Callable[..., Any], *args: Any) -> Any:
        """Call what listens, while a person says a word."""
        listening: Future[Any] = self._rapp.begin(function, *args)
        until = time.monotonic() + PATIENCE
        while not listening.done() and time.monotonic() < until:
            self._robot.say(word)
            time.sleep(0.2)
        return listening.result(0)

    def rests(self) -> tuple[str, bool]:
        """The family of its posture, and whether any of its motors is on."""
        call = self._robot.naoqi.call
        return str(call("ALRobotPosture", "getPostureFamily")), any(call("ALMotion", "getStiffnesses", "Body"))

    def close(self) -> None:
        self._rapp.close()


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    whole = WholeRobot(tmp_path_factory.mktemp("rapp_api"), body=True)
    whole.settings = SETTINGS
    install_lender(whole.home)
    with whole_robot(whole, "roscore", "nao_sim", "core_agent"):
        side = Robot(whole)
        try:
            yield side
        finally:
            side.close()


@pytest.fixture(params=["fake", "robot"])
def side(request: pytest.FixtureRequest) -> Iterator[Desk | Robot]:
    """Both core agents, one after the other."""
    if request.param == "robot":
        yield request.getfixturevalue("robot")
        return
    desk = Desk()
    yield desk
    desk.close()


Side = Desk | Robot

WRONG: list[tuple[type[Exception], str, Callable[..., Any], tuple[Any, ...]]] = [
    (Invalid, "text", communication.text_to_speech, (" ",)),
    (Invalid, "text", communication.text_to_speech, ("x" * 4001,)),
    (Invalid, "", communication.text_to_speech, ("\ud800",)),
    (Refused, "'tlh'", communication.text_to_speech, ("nuqneH", "tlh")),
    (Invalid, "words", communication.word_spotting, ([],)),
    (Invalid, "words", communication.word_spotting, (["clock", " "],)),
    (Invalid, "words", communication.word_spotting, (["clock"] * 101,)),
    (Invalid, "0.1 to 300", communication.capture_audio, (0.0,)),
    (Invalid, "0.1 to 300", communication.capture_audio, (NAN,)),
    (Invalid, "0.1 to 300", communication.capture_audio, (301.0,)),
    (Invalid, "0.1 to 60", communication.capture_audio_until_silence, ("", 0.0)),
    (Invalid, "energy", communication.capture_audio_until_silence, ("", 1.0, 0)),
    (Invalid, "ogg", communication.capture_audio_until_silence, ("sound.wav",)),
    (Invalid, "ogg", communication.capture_audio_until_silence, ("../../sound.ogg",)),
    (Invalid, "nothing.ogg", communication.play_audio, ("nothing.ogg",)),
    (Invalid, "/etc/passwd", communication.play_audio, ("/etc/passwd",)),
    (Invalid, "volume", communication.play_audio, ("x.ogg", 0.0, 1.1)),
    (Invalid, "balance", communication.play_audio, ("x.ogg", 0.0, 1.0, NAN)),
    (Invalid, "position", communication.play_audio, ("x.ogg", -1.0)),
    (Invalid, "numbers", navigation.move_to, (NAN, 0.0, 0.0)),
    (Invalid, "", navigation.move_to, (1e308, 0.0, 0.0)),
    (Invalid, "", navigation.move_to, ("far", 0.0, 0.0)),
    (Refused, "10 m", navigation.move_to, (11.0, 0.0, 0.0)),
    (Invalid, "numbers", navigation.move_vel, (0.0, INF, 0.0)),
    (Refused, "0.1", navigation.move_vel, (0.2, 0.0, 0.0)),
    (Refused, "0.06", navigation.move_vel, (0.0, -0.1, 0.0)),
    (Refused, "0.5", navigation.move_vel, (0.0, 0.0, 1.0)),
    (Invalid, "HeadYaw.*LHand", navigation.move_joint, ("Tail", 0.0)),
    (Invalid, "HeadYaw.*LHand", navigation.move_joint, ("głowa\0", 0.0)),
    (Invalid, "", navigation.move_joint, ("HeadYaw", 1e308)),
    (Invalid, "HeadYaw", navigation.move_joint, ("HeadYaw", 2.2)),
    (Invalid, "HeadYaw", navigation.move_joint, ("HeadYaw", NAN)),
    (Invalid, "one angle", navigation.move_joint, (["HeadYaw", "HeadPitch"], [0.0])),
    (Invalid, "joints", navigation.move_joint, ([], [])),
    (Invalid, "share", navigation.move_joint, ("HeadYaw", 0.1, 1.5)),
    (Invalid, "Crouch", navigation.take_predefined_posture, ("Headstand",)),
    (Invalid, "share", navigation.take_predefined_posture, ("Stand", NAN)),
    (Invalid, "numbers", navigation.look_at_point, (INF, 0.0, 0.0)),
    (Refused, "neck", navigation.look_at_point, (-1.0, 0.1, 0.4)),
    (Invalid, "Crouch", navigation.rest, ("Stand",)),
    (Invalid, "1 to 100", navigation.move_along_path, ([],)),
    (Invalid, "1 to 100", navigation.move_along_path, ([Pose(0.0, 0.0)] * 101,)),
    (Invalid, "base_link", navigation.move_along_path, ([Pose(0.0, 0.0, 0.0, "moon")],)),
    (Invalid, "numbers", navigation.move_along_path, ([Pose(0.0, NAN, 0.0, "odom")],)),
    (Refused, "10 m", navigation.move_along_path, ([Pose(6.0, 0.0, 0.0, "base_link"), Pose(0.0, 0.0, 0.0, "base_link")],)),
    (Invalid, "numbers", navigation.set_global_pose, (Pose(INF, 0.0),)),
    (Invalid, "'Tail'.*CameraTop", navigation.get_transform, ("Tail", 0)),
    (Invalid, "0 torso, 1 world, 2 robot", navigation.get_transform, ("Head", 3)),
    (Invalid, "top, bottom", vision.capture_image, ("left",)),
    (Invalid, "4VGA", vision.capture_image, ("top", 4)),
    (Invalid, "", vision.capture_image, ("top", 1 << 40)),
    (Invalid, "0 top, 1 bottom", vision.set_camera_param, (2, 0, 1)),
    (Refused, "parameter 99", vision.set_camera_param, (0, 99, 1)),
    (Refused, "0 to 255", vision.set_camera_param, (0, 0, 256)),
    (Invalid, "0 top, 1 bottom", vision.set_camera_params, (2, [0], [1])),
    (Invalid, "one value", vision.set_camera_params, (0, [0], [])),
    (Invalid, "name a file", keepsakes.keep, ("../passwd", b"")),
    (Refused, "smaller", keepsakes.keep, ("large", bytes((8 << 20) + 1))),
]
"""Calls of no use, and what of the error says what to do."""


def answer(side: Side, function: Callable[..., Any], args: tuple[Any, ...]) -> tuple[type[Exception] | None, str]:
    try:
        side.call(function, *args)
    except RappError as error:
        return type(error), str(error)
    return None, ""


def test_r04_a_call_of_no_use_is_told_what_would_be_of_use(side: Side) -> None:
    surprises = []
    for kind, words, function, args in WRONG:
        found, text = answer(side, function, args)
        if found is not kind or not re.search(f"^cannot .*{words}", text):
            surprises.append(f"{function.__name__}{str(args)[:60]}: {found} {text}, not {kind} {words}")
    assert surprises == []


def test_says(side: Side) -> None:
    side.call(communication.text_to_speech, "good morning")
    side.call(communication.rapp_say, "dzień dobry", "pl")


def test_spots_a_word_as_it_is_spelt_or_tells_that_there_was_none(side: Side) -> None:
    assert side.hears("elizabeth", communication.word_spotting, ["clock", "Elizabeth"], 30.0) == "Elizabeth"
    assert side.call(communication.word_spotting, ["clock"], 0.3) == communication.EMPTY


def test_records_and_plays_what_it_has_recorded(side: Side) -> None:
    path = side.call(communication.capture_audio, 0.2)
    other = side.call(communication.capture_audio_until_silence, "greeting.ogg", 0.2)
    assert path.endswith(".ogg")
    assert other.endswith("/greeting.ogg")
    side.call(communication.play_audio, path)
    side.call(communication.play_audio, other, 0.05, 0.5, -1.0, True)
    side.call(communication.play_audio, path)


def test_walks_to_a_pose_and_knows_where_it_is(side: Side) -> None:
    side.call(navigation.set_global_pose, Pose(2.0, 1.0, math.pi / 2))
    side.call(navigation.move_to, 0.1, 0.0, 0.2)
    pose = side.call(navigation.get_robot_pose)
    assert (pose.x, pose.y, pose.theta) == pytest.approx((2.0, 1.1, math.pi / 2 + 0.2), abs=0.05)
    assert pose.frame == "map"


def test_walks_along_a_path(side: Side) -> None:
    side.call(navigation.set_global_pose, Pose(0.0, 0.0, 0.0))
    side.call(navigation.move_along_path, [Pose(0.08, 0.0, 0.0, "base_link"), Pose(0.15, 0.0, 0.0)])
    assert side.call(navigation.get_robot_pose).x == pytest.approx(0.15, abs=0.05)


def test_begins_to_walk_and_stops(side: Side) -> None:
    assert side.call(navigation.move_vel, 0.05, 0.0, 0.1) == ""
    assert side.call(navigation.move_vel, -0.05, 0.0, 0.0) == ""
    assert side.call(navigation.move_stop) == ""
    side.call(navigation.move_stop)


def test_moves_joints(side: Side) -> None:
    side.call(navigation.move_joint, "HeadYaw", 0.3, 1.0)
    side.call(navigation.move_joint, ["HeadYaw", "LElbowRoll"], [0.0, -1.0], 1.0)


def test_looks_takes_postures_and_rests(side: Side) -> None:
    side.call(navigation.take_predefined_posture, "StandInit", 1.0)
    side.call(navigation.look_at_point, 1.0, 0.3, 0.4)
    assert side.rests() == ("Standing", True)
    side.call(navigation.rest)
    assert side.rests() == ("Sitting", False)
    side.call(navigation.take_predefined_posture, "StandInit", 1.0)


@pytest.mark.parametrize("space", [navigation.TORSO, navigation.WORLD, navigation.ROBOT])
def test_tells_where_its_parts_are(side: Side, space: int) -> None:
    for name in ("HeadYaw", "Head", "Torso", "CameraTop"):
        matrix = side.call(navigation.get_transform, name, space)
        assert matrix.shape == (4, 4)
        assert matrix[3] == pytest.approx((0.0, 0.0, 0.0, 1.0))
        assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("camera", ["top", "bottom"])
def test_sees(side: Side, camera: str) -> None:
    for resolution, shape in {0: (120, 160, 3), 1: (240, 320, 3), 2: (480, 640, 3), 3: (960, 1280, 3)}.items():
        picture = side.call(vision.capture_image, camera, resolution)
        assert (picture.shape, picture.dtype) == (shape, np.uint8)


def test_sets_what_its_cameras_take_and_tells_of_the_rest(side: Side) -> None:
    side.call(vision.set_camera_param, vision.TOP, 0, 60)
    assert side.call(vision.set_camera_params, vision.BOTTOM, [0, 99, 1], [60, 1, 1000]) == [True, False, False]
    side.call(vision.set_camera_params, vision.TOP, [0], [55])


def test_keeps_a_file_in_place_of_an_older_one(side: Side) -> None:
    path = side.call(keepsakes.keep, "picture.jpg", b"first")
    assert path.endswith("/picture.jpg")
    assert side.call(keepsakes.keep, "picture.jpg", b"second") == path


def test_lets_time_pass(side: Side) -> None:
    side.call(pause, 0.1)


GOALS = {
    "rapp_move_to": ({"x": 0.05}, {"x": NAN}),
    "rapp_move_along_path": (None, {"poses": []}),
    "rapp_take_predefined_posture": ({"posture": "StandInit"}, {"posture": "Headstand"}),
    "rapp_move_joint": ({"joints": ["HeadYaw"], "angles": [0.1]}, {"joints": ["Tail"], "angles": [0.1]}),
}
SUCCEEDED, ABORTED = 3, 4


@pytest.mark.parametrize("name", GOALS)
def test_an_action_ends_as_its_service_does(side: Side, name: str) -> None:
    useful, useless = GOALS[name]
    if useful is not None:
        assert side.call(goal, name, useful) == (SUCCEEDED, True, "")
    assert side.call(goal, name, useless) == (ABORTED, False, "invalid")


def test_every_function_is_among_the_wrong_calls_or_takes_nothing_that_can_be_wrong() -> None:
    modules = {"communication": communication, "navigation": navigation, "vision": vision}
    functions = {getattr(modules[module], name) for module, _, name in (row.api.partition(".") for row in CORE_SERVICES)}
    never_wrong = {navigation.move_stop, navigation.get_robot_pose}
    assert {function for _, _, function, _ in WRONG} == functions - never_wrong | {keepsakes.keep}
