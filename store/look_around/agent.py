"""Stands up, looks around, and says the texts of the QR codes it sees: the smallest RApp that moves and sees."""

import cv2

from rapp_api import DynamicAgent, communication, navigation, vision

POINTS = [(2.0, 1.5, 0.5), (2.0, 0.0, 0.5), (2.0, -1.5, 0.5)]
"""Where to look: m ahead, to the left, above the ground."""


class LookAround(DynamicAgent):
    """The dynamic agent."""

    def initialise(self) -> None:
        """Nothing is read yet."""
        self.read: list[str] = []

    def execute(self) -> None:
        """Look at each point, and say what is new."""
        navigation.take_predefined_posture("StandInit")
        for point in POINTS:
            navigation.look_at_point(*point)
            picture = vision.capture_image("top", vision.QUAD_VGA)
            text = cv2.QRCodeDetector().detectAndDecode(picture)[0] if picture.size else ""
            if text and text not in self.read:
                self.read.append(text)
                communication.text_to_speech(f"I read: {text}")
        if not self.read:
            communication.text_to_speech("I see nothing to read")

    def terminate(self) -> None:
        """Sit down, however it went."""
        navigation.rest()
