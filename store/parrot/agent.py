"""Records what the person says until they are silent, and plays it back."""

from rapp_api import DynamicAgent, communication


class Parrot(DynamicAgent):
    """The dynamic agent."""

    def execute(self) -> None:
        """Listen, then repeat."""
        communication.text_to_speech("speak, and I repeat it")
        communication.play_audio(communication.capture_audio_until_silence("parrot.ogg", waiting_time=2.0))
