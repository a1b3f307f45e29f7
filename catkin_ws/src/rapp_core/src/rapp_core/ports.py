"""The walls of the core agent: what it needs of robot, cloud and ROS, and nothing of how they do it.

Virtual effectors and receptors are the paper's (section III): e_ls the loudspeaker, r_mic the microphones; those of
the body are in `body_ports`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from rapp_core.body_ports import Camera, Feeling, Motion
from rapp_core.manifest import Manifest

INSIDE_PACKAGE = "/rapp/package"
"""Where a dynamic agent sees its package."""


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
        """Record the front microphone as Ogg Vorbis into `path`, asynchronously. Raises Unreachable."""

    def check(self) -> None:
        """Raise what is known by now to be wrong with the recording: Refused, Unreachable."""

    def stop(self) -> None:
        """End the recording; the file is complete when this returns. Raises what was wrong with it, unless `check` did."""

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


@dataclass(frozen=True)
class Robot:
    """All virtual effectors and receptors of one robot."""

    voice: Voice
    ears: Ears
    recorder: Recorder
    player: Player
    motion: Motion
    feeling: Feeling
    camera: Camera
    present: Callable[[], bool]  # whether the robot is connected at this moment


@dataclass(frozen=True)
class Undelivered:
    """A mail that was refused after it had been kept, and of which nobody has been told."""

    message_id: str
    recipients: tuple[str, ...]  # addresses


class Hop(Protocol):
    """The link: all calls that leave the robot (rapp_hop/*)."""

    def request(self, name: str, arguments: Mapping[str, Any], timeout: float, cut: Callable[[], bool] = lambda: False) -> Any:
        """Ask, wait for the end of the job, give its JSON result. Raises Refused, Unreachable, Invalid, Bug.

        An Unreachable whose reason is NOT_KNOWN: the link may do it all the same.
        Once `cut` holds the job is cancelled, and refused.
        """

    def keep(self, run: str) -> None:
        """Tell the link that a run with a cloud agent lives; "": none does. Returns at once, also without a link."""

    @property
    def present(self) -> bool:
        """Whether the link is there at this moment."""

    @property
    def undelivered(self) -> Undelivered | None:
        """A mail of which the person has to be told, and after it the link by `mail_told`."""


class Signal(Protocol):
    """Something that happens once."""

    def is_set(self) -> bool:
        """Whether it has happened."""

    def wait(self, timeout: float) -> bool:
        """Wait for it, at most `timeout` s; gives whether it has happened."""


class Agent(Protocol):
    """One run of a dynamic agent, as the control subsystem sees it. Times are those of the monotonic clock, in s."""

    @property
    def name(self) -> str:
        """Name of the run."""

    @property
    def token(self) -> str:
        """Secret of the run, told over its own channel."""

    @property
    def manifest(self) -> Manifest | None:
        """The RApp's; None before it is activated."""

    @property
    def recordings(self) -> Path:
        """Where what is recorded for it goes."""

    @property
    def package(self) -> Path:
        """Its package, which it sees as `INSIDE_PACKAGE`."""

    @property
    def alive(self) -> bool:
        """Whether its process runs."""

    @property
    def first_word(self) -> Signal:
        """It has opened its channel (Fig. 3, s1)."""

    @property
    def outcome(self) -> tuple[str, str] | None:
        """ "done" or "failed", and why, once it has sent "terminate"."""

    @property
    def heartbeat(self) -> float:
        """When its last heartbeat came."""

    progress: float
    """When its own loop last moved, or waited for a core service that ran for it."""

    @property
    def waits(self) -> bool:
        """Whether its own loop waits for a core service, as far as it says."""

    def dismantle(self, patience: float, hurry: Signal) -> bool:
        """Ask it to stop what it has started; gives whether it answered within `patience` s, or before `hurry`."""

    def end(self, patience: float, keep_log: Path | None = None) -> None:
        """End and reap all its processes: SIGTERM, after `patience` s SIGKILL; what it printed goes to `keep_log`."""


Told = Callable[[dict[str, Any]], None]
"""Called with what passes over a dynamic agent's channel: `activate` to it, all others from it."""


class Agents(Protocol):
    """Starts dynamic agents (DESIGN section 3.6)."""

    def prepare(self) -> None:
        """Have a spare warming up."""

    def activate(self, package: Path, told: Told) -> Agent:
        """Run a package as a dynamic agent; what that sends is told. Raises Invalid, Unreachable, Bug."""

    def log_of(self, manifest: Manifest) -> Path:
        """Where what a RApp prints is kept."""
