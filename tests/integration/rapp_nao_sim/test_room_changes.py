"""The room changes at run time through SimWorld, and the robot sees and hears it."""

import time
from pathlib import Path

import cv2
import numpy as np
import pytest

ROOM = Path(__file__).with_name("seen.toml")
VGA, BGR = 2, 13


@pytest.fixture(scope="module")
def world(bodied):
    return bodied.service("SimWorld")


@pytest.fixture(autouse=True)
def as_described(world):
    world.loadRoom(str(ROOM))


@pytest.fixture
def look(bodied):
    video = bodied.service("ALVideoDevice")
    handle = video.subscribeCamera("look", 0, VGA, BGR, 30)

    def take():
        image = video.getImageRemote(handle)
        return np.frombuffer(bytes(image[6]), np.uint8).reshape(image[1], image[0], 3)

    yield take
    video.unsubscribe(handle)


def red(image):
    """How many pixels are red."""
    blue, green, redness = (image[..., channel].astype(int) for channel in range(3))
    return int(((redness > 2 * blue) & (redness > 2 * green)).sum())


def green(image):
    blue, greenness, redness = (image[..., channel].astype(int) for channel in range(3))
    return (greenness > 1.5 * blue) & (greenness > 1.5 * redness)


def test_the_lamp_lights_the_room(world, look, bodied):
    video, means = bodied.service("ALVideoDevice"), {}
    for automatic in (1, 0):
        assert video.setParameter(0, 11, automatic)
        for level in (0.0, 0.5, 1.0):
            world.setLamp(level)
            assert world.getLamp() == level
            means[automatic, level] = float(look().mean())
    assert video.setAllParametersToDefault(0)
    assert means[0, 0.0] < 0.8 * means[0, 0.5] < 0.9 * means[0, 1.0]
    assert means[1, 0.0] < 0.8 * means[1, 1.0]  # more than the automatic exposure can make up for
    assert means[1, 0.0] > 1.2 * means[0, 0.0]


def test_the_door_opens(world, look, failing, bodied):
    motion = bodied.service("ALMotion")
    motion.setStiffnesses("Head", 1.0)
    motion.angleInterpolation("HeadYaw", -0.7, 0.7, True)  # the door is out of sight otherwise
    shut, again = look().astype(int), look().astype(int)
    world.setDoor(0.8)
    assert world.getDoor() == 0.8
    changed, by_itself = ((np.abs(each - shut).max(axis=2) > 25).mean() for each in (look().astype(int), again))
    assert changed > 0.02 > by_itself
    with failing("SimWorld::setDoor", "at most pi"):
        world.setDoor(4.0)
    assert world.getDoor() == 0.8
    motion.angleInterpolation("HeadYaw", 0.0, 0.7, True)


def test_things_come_move_and_go(world, look, failing):
    assert red(look()) < 50
    world.placeObject("ball", 0.8, 0.0, 0.45, 0.0)
    seen = red(look())
    assert seen > 1500
    world.placeObject("ball", 1.4, 0.0, 0.45, 0.0)
    assert 50 < red(look()) < 0.6 * seen
    world.removeObject("ball")
    assert red(look()) < 50
    with failing("SimWorld::placeObject", "cannot find object 'sofa': known are stool, ball, code, face, Eva"):
        world.placeObject("sofa", 0.0, 0.0, 0.0, 0.0)
    with failing("SimWorld::removeObject", "known are stool"):
        world.removeObject("sofa")
    with failing("SimWorld::placeObject", "metres and radians"):
        world.placeObject("ball", float("nan"), 0.0, 0.0, 0.0)


def test_a_thing_moves_with_all_its_parts(world, look):
    before = green(look())
    world.placeObject("stool", 1.0, 0.1, 0.28, 0.5)
    after = green(look())
    assert after.sum() > 1500
    columns = [np.flatnonzero(picture.any(axis=0)).mean() for picture in (before, after) if picture.any()]
    assert columns[-1] == pytest.approx(320 - 543 * 0.1 / 0.94, abs=25)
    leg = after[-1] if after[-1].any() else after[np.flatnonzero(after.any(axis=1))[-1]]
    assert np.flatnonzero(leg).mean() == pytest.approx(columns[-1], abs=25)


def test_nothing_is_put_into_the_robot(world, failing):
    pose = world.getRobotPose()
    with failing("SimWorld::placeObject", "would touch the robot"):
        world.placeObject("stool", 0.05, 0.0, 0.28, 0.0)
    with failing("SimWorld::placePerson", "would touch the robot"):
        world.placePerson("Eva", 0.1, 0.0)
    assert world.getRobotPose() == pytest.approx(pose, abs=1e-3)
    [stool] = [thing for thing in world.listObjects() if thing["name"] == "stool"]
    assert (stool["x"], stool["y"], stool["placed"]) == (1.0, -0.5, True)


def test_the_door_does_not_go_through_the_robot(world, failing, folder):
    room = folder / "narrow.toml"
    room.write_text(ROOM.read_text().replace("hinge = [1.6, -1.1]", "hinge = [0.3, 0.3]"))
    world.loadRoom(str(room))
    with failing("SimWorld::setDoor", "the robot stands in its way"):
        world.setDoor(-0.9)
    assert world.getDoor() == 0.0


def test_a_persons_face_is_found(world, look, bodied):
    world.placePerson("Eva", 1.3, 0.25)
    bodied.service("ALMotion").angleInterpolation(["HeadYaw", "HeadPitch"], [0.15, -0.2], 0.4, True)
    finder = cv2.CascadeClassifier(cv2.data.haarcascades + "haarcascade_frontalface_default.xml")
    faces = finder.detectMultiScale(cv2.cvtColor(look(), cv2.COLOR_BGR2GRAY), 1.1, 4)
    assert any(abs(x + width / 2 - 320) < 60 for x, _, width, _ in faces), faces
    [eva] = [thing for thing in world.listObjects() if thing["name"] == "Eva"]
    assert (eva["kind"], eva["voice"], eva["placed"]) == ("person", "en-us+f3", True)
    assert eva["theta"] == pytest.approx(np.arctan2(-0.25, -1.3), abs=0.01)  # to the robot
    bodied.service("ALMotion").angleInterpolation(["HeadYaw", "HeadPitch"], [0.0, 0.0], 0.4, True)


def loudest(bodied, seconds):
    device, until = bodied.service("ALAudioDevice"), time.monotonic() + seconds
    levels = []
    while time.monotonic() < until:
        levels.append(device.getFrontMicEnergy())
        time.sleep(0.02)
    return max(levels)


def test_a_voice_fades_with_the_distance(world, bodied, failing):
    with failing("SimWorld::personSays", "there are none"):
        world.personSays("Eva", "hello")
    levels = []
    for away in (0.5, 2.0):
        world.placePerson("Eva", -away, 0.0)
        world.personSays("Eva", "hello robot")
        levels.append(loudest(bodied, 1.3))
    assert levels[0] > 2.5 * levels[1] > 0
    with failing("SimWorld::placePerson", "known are Eva"):
        world.placePerson("stool", 0.0, 0.0)


def test_another_room_is_loaded_with_the_robot_at_its_start(world, look, failing, folder):
    room = folder / "other.toml"
    room.write_text(ROOM.read_text().replace("x = 0.0\ny = 0.0", "x = -0.5\ny = 0.3").replace('name = "ball"', 'name = "dice"'))
    world.loadRoom(str(room))
    assert world.getRobotPose() == pytest.approx([-0.5, 0.3, 0.0], abs=0.01)
    assert "dice" in [thing["name"] for thing in world.listObjects()]
    world.placeObject("dice", 0.4, 0.3, 0.4, 0.0)
    assert red(look()) > 1000
    with failing("SimWorld::loadRoom", "cannot read the room file"):
        world.loadRoom(str(folder / "none.toml"))
    room.write_text("[floor]\n")
    with failing("SimWorld::loadRoom", "'size' of [floor] is missing"):
        world.loadRoom(str(room))
    assert "dice" in [thing["name"] for thing in world.listObjects()]
