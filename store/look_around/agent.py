"""Stands up, looks around, turns, and says the texts of the QR codes it sees: the smallest RApp that moves and sees."""

import json
import math

import cv2

from rapp_api import DynamicAgent, communication, navigation, vision

POINTS = [(1.0, 1.5, 0.6), (2.0, 0.0, 0.6), (1.0, -1.5, 0.6)]
"""Where to look: m ahead, to the left, above the ground."""


class LookAround(DynamicAgent):
    """The dynamic agent."""

    def initialise(self) -> None:
        """Nothing is read yet."""
        self.read: list[str] = []

    def execute(self) -> None:
        """Look to one half of the room, then to the other."""
        navigation.take_predefined_posture("StandInit")
        self.look()
        navigation.move_to(0.0, 0.0, math.pi)
        self.look()
        if not self.read:
            communication.text_to_speech("I see nothing to read")

    def look(self) -> None:
        """Look at each point, and say what is new."""
        for point in POINTS:
            navigation.look_at_point(*point)
            picture = vision.capture_image("top", vision.QUAD_VGA)
            text = cv2.QRCodeDetector().detectAndDecode(picture)[0] if picture.size else ""
            if text and text not in self.read:
                self.read.append(text)
                communication.text_to_speech(f"I read: {name(text)}")

    def terminate(self) -> None:
        """Sit down, however it went."""
        navigation.rest()


def name(text: str) -> str:
    """What to say of a code: the name in it when it is a JSON object, as those of the simulated room are."""
    try:
        return str(json.loads(text)["name"])
    except (ValueError, KeyError, TypeError):
        return text
