"""Virtual effector e_ls on ALTextToSpeech (paper Fig. 5)."""

from rapp_core.errors import Refused
from rapp_core.robot.naoqi.connection import Connection

SECONDS_PER_CHARACTER = 0.25  # s; the slowest speech to wait for
LANGUAGES = {
    "en": "English", "pl": "Polish", "fr": "French", "de": "German", "es": "Spanish", "it": "Italian", "el": "Greek",
    "pt": "Portuguese", "nl": "Dutch", "sv": "Swedish", "da": "Danish", "fi": "Finnish", "cs": "Czech", "ru": "Russian",
    "tr": "Turkish", "ja": "Japanese", "ko": "Korean", "zh": "Chinese", "ar": "Arabic",
}  # fmt: skip
"""NAOqi's names of languages."""


class NaoqiVoice:
    """Says texts; an unknown language is refused by name."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def say(self, text: str, language: str) -> None:
        """Call `say` synchronously; see `ports.Voice`."""
        name = LANGUAGES.get(language.split("-")[0].lower())
        if name is None:
            raise Refused(f"cannot speak language {language!r}: known are {', '.join(sorted(LANGUAGES))}")
        timeout = 10 + SECONDS_PER_CHARACTER * len(text)
        if name == "English":
            self._connection.call("ALTextToSpeech", "say", text, timeout=timeout)
            return
        if name not in self._connection.call("ALTextToSpeech", "getAvailableLanguages"):
            raise Refused(f"cannot speak {name}: this robot has no such voice; install it on the robot")
        self._connection.call("ALTextToSpeech", "say", text, name, timeout=timeout)

    def hush(self) -> None:
        """See `ports.Voice`."""
        self._connection.call("ALTextToSpeech", "stopAll")
