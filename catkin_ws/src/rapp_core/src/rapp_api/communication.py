"""Communication API (deliverable section 4.5.1), and the paper's own names for three of its functions (paper section V.B)."""

from collections.abc import Sequence

from rapp_api.core_agent import current
from rapp_api.errors import Invalid

EMPTY = "Empty"
"""What word spotting gives when no word was detected."""


def text_to_speech(text: str, language: str = "en") -> None:
    """Say a text; returns when it has been said. Raises Refused for a language the robot does not speak, Unreachable."""
    current().say(text, language)


def word_spotting(dictionary: Sequence[str], timeout: float = 0.0) -> str:
    """Listen for one of the words, at most `timeout` s (0: the core agent's own); the word as spelt here, or "Empty"."""
    if isinstance(dictionary, str) or not dictionary:
        raise Invalid("cannot listen without words: give a list of words")
    return current().recognize(list(dictionary), timeout)


def capture_audio(time: float) -> str:
    """Record for `time` s; gives the path of the Ogg Vorbis file."""
    return current().record(time)


def capture_audio_until_silence(path: str = "", waiting_time: float = 2.0, microphone_energy: int = 1700) -> str:
    """Record until it was quieter than `microphone_energy` for `waiting_time` s; gives the path of the Ogg Vorbis file."""
    return current().record_until_silence(path, waiting_time, microphone_energy)


def play_audio(path: str, position: float = 0.0, volume: float = 1.0, balance: float = 0.0, loop: bool = False) -> None:
    """Play a file from `position` s, volume 0..1, balance -1 (left) .. 1 (right); a loop goes on when this returns."""
    current().play_audio(path, position, volume, balance, loop)


rapp_say = text_to_speech
rapp_recognize = word_spotting
rapp_record = capture_audio
