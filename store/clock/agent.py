"""Tells the time of day; needs nothing of the cloud, so it runs from the robot's disk when the platform is away."""

from datetime import datetime

from rapp_api import DynamicAgent, communication


class Clock(DynamicAgent):
    """The dynamic agent."""

    def execute(self) -> None:
        """Say the hour and the minute."""
        now = datetime.now()
        minutes = f"{now.minute} minutes past {now.hour}" if now.minute else f"{now.hour} o'clock"
        communication.text_to_speech(f"it is {minutes}")
