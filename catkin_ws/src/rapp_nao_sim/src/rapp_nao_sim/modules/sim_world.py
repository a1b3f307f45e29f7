"""SimWorld, the simulator's own module: people who speak in the room, its things, door, lamp, noise and picture."""

import math
from pathlib import Path
from typing import Any

import qi

from rapp_nao_sim.modules.sim_body import SimBody
from rapp_nao_sim.naoqi import NaoqiError, quick, working
from rapp_nao_sim.sound.room import Mixer, Sounding
from rapp_nao_sim.sound.samples import load
from rapp_nao_sim.sound.synthesis import speak
from rapp_nao_sim.speech.hearing import Hearing
from rapp_nao_sim.world.process import WorldClient

NEAREST = 0.3  # m, to a speaking mouth; a voice has its level at 1 m, and fades with the distance
LOUDEST = 16_000.0  # RMS of 16-bit samples; more noise would be cut off at full scale


@qi.multiThreaded()
class SimWorld(SimBody):
    """What happens in the room beside the robot. Signals: `robotSaid(text)`, `personSpoke(text)`.

    Calls overlap: what two people say at once is mixed at the microphone.
    """

    def __init__(self, mixer: Mixer, hearing: Hearing, level: float, text_fed: bool, world: WorldClient | None) -> None:
        super().__init__(world)
        self.robotSaid = qi.Signal("(s)")
        self.personSpoke = qi.Signal("(s)")
        self.__mixer = mixer
        self.__hearing = hearing
        self.__level = level
        self.__text_fed = text_fed
        self.__world = world

    @working
    def personSay(self, text: str, voice: str, options: dict[str, float] | None = None) -> None:  # noqa: N802
        """A person says a text with an espeak-ng voice; ends when it has been said.

        Options: "speed" in words per minute (150), "level" from 0 to 1. With the text-fed microphone the words reach the ears
        at once, and the sound sounds on without being waited for.
        """
        self.__say(text, voice, options or {}, 1.0)

    @working
    def personSays(self, name: str, text: str, options: dict[str, float] | None = None) -> None:  # noqa: N802
        """A person of the room says a text with their voice, from where they stand: the level holds at 1 m from the robot.

        The text-fed microphone hears them at any distance.
        """
        world = self.__there()
        person = next((thing for thing in world.objects() if thing["name"] == name and thing["kind"] == "person"), None)
        if person is None or not person["placed"]:
            here = [thing["name"] for thing in world.objects() if thing["kind"] == "person" and thing["placed"]]
            raise NaoqiError(f"cannot find person {name!r} in the room: there are {', '.join(here) or 'none'}")
        x, y, _ = world.robot_pose()
        away = max(NEAREST, math.hypot(person["x"] - x, person["y"] - y))
        self.__say(text, person["voice"], options or {}, 1 / away)

    def __say(self, text: str, voice: str, options: dict[str, float], gain: float) -> None:
        wishes = {"speed": 150.0, "level": self.__level, **options}
        samples = speak(text, voice, int(wishes["speed"]))
        sounding = self.__mixer.add(Sounding(samples, float(wishes["level"]) * gain))
        if self.__text_fed:
            self.__hearing.feed_text(text)
        else:
            sounding.done.result()
        self.personSpoke(text)

    @working
    def personPlay(self, name: str) -> None:  # noqa: N802
        """A recording of a person sounds in the room; ends at its end."""
        self.__mixer.add(Sounding(load(Path(name)), 1.0)).done.result()

    @quick
    def micText(self, text: str) -> None:  # noqa: N802
        """Words for the text-fed microphone, without any sound."""
        if not self.__text_fed:
            raise NaoqiError("the microphone hears sound; start nao_sim with --microphone text")
        self.__hearing.feed_text(str(text))

    @quick
    def setNoise(self, level: float) -> None:  # noqa: N802
        """Noise floor of the room, root mean square of 16-bit samples; 60 is a quiet room, speech has about 2000."""
        if not 0 <= float(level) <= LOUDEST:
            raise NaoqiError(f"cannot set the noise to {level}: its level is from 0 to {LOUDEST:g}")
        self.__mixer.ambient = float(level)

    @quick
    def getNoise(self) -> float:  # noqa: N802
        """Noise floor of the room."""
        return self.__mixer.ambient

    @working
    def getRobotPose(self) -> list[float]:  # noqa: N802
        """True pose of the robot in the room: x and y in m, theta in rad."""
        return list(self.__there().robot_pose())

    @working
    def setDoor(self, angle: float) -> None:  # noqa: N802
        """Turn the door to an opening angle in rad; its sign says to which side, 0 is closed."""
        self.__there().set_door(float(angle))

    @working
    def getDoor(self) -> float:  # noqa: N802
        """Opening angle of the door, rad."""
        return self.__there().furnishing()[0]

    @working
    def setLamp(self, level: float) -> None:  # noqa: N802
        """Set the lamp from 0 (dark) to 1."""
        self.__there().set_lamp(float(level))

    @working
    def getLamp(self) -> float:  # noqa: N802
        """Level of the lamp."""
        return self.__there().furnishing()[1]

    @working
    def placeObject(self, name: str, x: float, y: float, z: float, theta: float) -> None:  # noqa: N802
        """Put a thing somewhere: where the room file has `centre`, and `yaw` or `facing`, of its first part. Not into the robot."""
        self.__there().place_object(name, (x, y, z, theta))

    @working
    def removeObject(self, name: str) -> None:  # noqa: N802
        """Take a thing or a person out of the room; placing brings it back."""
        self.__there().remove_object(name)

    @working
    def placePerson(self, name: str, x: float, y: float, *theta: float) -> None:  # noqa: N802
        """Put a person on the floor, facing theta or, without it, the robot."""
        world = self.__there()
        robot_x, robot_y, _ = world.robot_pose()
        world.place_person(name, (x, y, theta[0] if theta else math.atan2(robot_y - y, robot_x - x)))

    @working
    def listObjects(self) -> list[dict[str, Any]]:  # noqa: N802
        """Every thing of the room: name, kind (box, cylinder, picture, person), placed, x, y, z, theta; voice of a person."""
        return self.__there().objects()

    @working
    def loadRoom(self, name: str) -> None:  # noqa: N802
        """Have the room of another file, with the robot at its start there."""
        self.__there().load_room(Path(name))

    @working
    def startAt(self, name: str) -> None:  # noqa: N802
        """Put the robot at one of the places that the room file has as `starts`, standing as at the start."""
        self.__there().start_at(name)

    @working
    def photograph(self, name: str) -> None:
        """Write a picture of the room as a PNG file."""
        self.__there().photograph(Path(name))

    def __there(self) -> WorldClient:
        if self.__world is None:
            raise NaoqiError("there is no world: nao_sim was started with --no-world")
        return self.__world
