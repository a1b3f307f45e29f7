"""The walls of the core agent: what it needs of robot, cloud and ROS, and nothing of how they do it.

Virtual effectors and receptors are the paper's (section III): e_ls the loudspeaker, r_mic the microphones, e_body the body.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol


@dataclass(frozen=True)
class Word:
    """A word heard by the receptor, with its probability from 0 to 1."""

    text: str
    probability: float


@dataclass(frozen=True)
class Sound:
    """A sound has begun or ended at the microphones."""

    begun: bool


class Voice(Protocol):
    """Virtual effector e_ls: loudspeaker and speech synthesis."""

    def say(self, text: str, language: str) -> None:
        """Say a text in a language (code such as "en"); returns when it has been said. Raises Refused, Unreachable."""

    def hush(self) -> None:
        """Stop saying."""


class Ears(Protocol):
    """Virtual receptor r_mic as recogniser of isolated words (paper Fig. 6)."""

    def set_vocabulary(self, words: Sequence[str]) -> None:
        """Update the set of words; raises Invalid, Unreachable."""

    def subscribe(self, heard: Callable[[Word | Sound], None]) -> None:
        """Tell `heard` every word and sound from now on; called from a foreign thread, must return at once."""

    def unsubscribe(self) -> None:
        """End subscribe; no error when there was none."""


class Recorder(Protocol):
    """Virtual receptor r_mic as recorder (paper Fig. 7)."""

    def start(self, path: Path) -> None:
        """Record the front microphone as Ogg Vorbis into `path`, asynchronously. Raises Refused, Unreachable."""

    def stop(self) -> None:
        """End the recording; the file is complete when this returns."""

    def energy(self) -> float:
        """Energy at the front microphone in NAOqi's units (ambient noise is below about 1700)."""


class Player(Protocol):
    """Virtual effector e_ls as player of files."""

    def play(self, path: Path, position: float, volume: float, balance: float) -> None:
        """Play a file from `position` (s) to its end, volume 0..1, balance -1..1. Raises Refused, Unreachable."""

    def loop(self, path: Path, volume: float, balance: float) -> None:
        """Play a file again and again; returns at once."""

    def stop(self) -> None:
        """Stop playing."""


class Body(Protocol):
    """Virtual effector e_body."""

    def stop(self) -> None:
        """Stop all motion now."""

    def release(self) -> None:
        """Take a safe posture and switch the motors off; goes on by itself when it takes longer than a moment."""


@dataclass(frozen=True)
class Robot:
    """All virtual effectors and receptors of one robot."""

    voice: Voice
    ears: Ears
    recorder: Recorder
    player: Player
    body: Body
    present: Callable[[], bool]  # whether the robot is connected at this moment


Progress = Callable[[str, float], None]


class Hop(Protocol):
    """The link: all calls that leave the robot (rapp_hop/*)."""

    def request(self, name: str, arguments: Mapping[str, Any], timeout: float, progress: Progress | None = None) -> Any:
        """Ask, wait for the end of the job, give its JSON result. Raises Refused, Unreachable, Invalid, Bug."""

    @property
    def present(self) -> bool:
        """Whether the link is there at this moment."""
