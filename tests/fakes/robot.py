"""A robot in memory: a person can speak to it, it notes in `journal` what it was told to do, and it can be taken away."""

from collections.abc import Callable, Sequence
from pathlib import Path

from fakes.clock import Clock
from fakes.robot_body import FakeCamera, FakeFeeling, FakeMotion
from rapp_core.errors import Invalid, Refused, Unreachable
from rapp_core.ports import Robot, Sound, Word

LANGUAGES = ("en", "pl", "fr")


class Body:
    """What all parts share: the journal, and whether the robot is there."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.journal: list[str] = []
        self.here = True
        self.energy = 500.0
        self.recording: Path | None = None
        self.looping: Path | None = None
        self.vocabulary: list[str] = []
        self.listener: Callable[[Word | Sound], None] | None = None

    def note(self, text: str) -> None:
        """Write down what the robot was told; raises Unreachable when it is away."""
        if not self.here:
            raise Unreachable("cannot reach the robot: it was taken away")
        if text:
            self.journal.append(text)


class FakeRobot:
    """`robot` is the port; the rest is the room around it."""

    def __init__(self, clock: Clock | None = None) -> None:
        self.body = Body(clock or Clock())
        self.motion = FakeMotion(self.body)
        self.feeling = FakeFeeling(self.body, self.motion)
        self.camera = FakeCamera(self.body)
        self.robot = Robot(
            FakeVoice(self.body), FakeEars(self.body), FakeRecorder(self.body), FakePlayer(self.body),
            self.motion, self.feeling, self.camera, lambda: self.body.here,
        )  # fmt: skip

    @property
    def journal(self) -> list[str]:
        return self.body.journal

    def said(self) -> list[str]:
        return [entry.removeprefix("say ") for entry in self.journal if entry.startswith("say ")]

    def person_says(self, text: str, probability: float = 0.9, seconds: float = 0.6) -> None:
        """A sound begins now, ends after `seconds`; then the recogniser tells what it takes the sound for."""
        self.body.clock.after(0.0, lambda: self._hear(Sound(True)))
        self.body.clock.after(seconds, lambda: self._hear(Sound(False)))
        if text in self.body.vocabulary or probability < 0.4:
            self.body.clock.after(seconds + 0.1, lambda: self._hear(Word(text, probability)))

    def person_says_at(self, time: float, text: str, probability: float = 0.9, seconds: float = 0.6) -> None:
        self.body.clock.at(time, lambda: self.person_says(text, probability, seconds))

    def _hear(self, item: Word | Sound) -> None:
        if self.body.listener is not None:
            self.body.listener(item)


class FakeVoice:
    def __init__(self, body: Body) -> None:
        self._body = body

    def say(self, text: str, language: str) -> None:
        if language not in LANGUAGES:
            raise Refused(f"cannot speak {language!r}: known are {', '.join(LANGUAGES)}")
        self._body.note(f"say {text}")

    def hush(self) -> None:
        self._body.note("hush")


class FakeEars:
    def __init__(self, body: Body) -> None:
        self._body = body

    def set_vocabulary(self, words: Sequence[str]) -> None:
        if not words or not all(word.strip() for word in words):
            raise Invalid("cannot listen for these words")
        self._body.note("setVocabulary")
        self._body.vocabulary = list(words)

    def subscribe(self, heard: Callable[[Word | Sound], None]) -> None:
        self._body.note("subscribe")
        self._body.listener = heard

    def unsubscribe(self) -> None:
        self._body.listener = None
        self._body.note("unsubscribe")


class FakeRecorder:
    def __init__(self, body: Body) -> None:
        self._body = body
        self._wrong: Refused | None = None

    def start(self, path: Path) -> None:
        self._body.note("startMicrophonesRecording")
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            self._wrong = Refused(f"cannot write {path}: it is a folder")
        else:
            self._body.recording = path

    def check(self) -> None:
        wrong, self._wrong = self._wrong, None
        if wrong is not None:
            raise wrong

    def stop(self) -> None:
        self._body.note("stopMicrophonesRecording")
        self.check()
        if self._body.recording is not None:
            self._body.recording.write_bytes(b"OggS")
            self._body.recording = None

    def energy(self) -> float:
        return self._body.energy


class FakePlayer:
    def __init__(self, body: Body) -> None:
        self._body = body

    def play(self, path: Path, position: float, volume: float, balance: float) -> None:
        if not path.exists():
            raise Refused(f"cannot play {path}: there is no such file")
        self._body.note(f"play {path.name} {position:g} {volume:g} {balance:g}")

    def loop(self, path: Path, volume: float, balance: float) -> None:
        self._body.note(f"loop {path.name} {volume:g} {balance:g}")
        self._body.looping = path

    def stop(self) -> None:
        self._body.note("stop playing")
        self._body.looping = None
