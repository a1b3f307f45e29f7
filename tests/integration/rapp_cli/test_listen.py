"""`./rapp listen` as a command: recordings, a microphone that is there, one that is not. The robot follows a script."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
import pytest
import soundfile

from rapp_cli.__main__ import main
from rapp_cli.home import conversation
from rapp_cli.home.place import Home, Settings
from rapp_cli.home.supervisor import Supervisor
from rapp_cli.person import Person
from rapp_cli.timeline import Entry
from rapp_nao_sim.sound.samples import RATE

DEVICE = """pcm.talker {{ type file slave.pcm "null" file "/dev/null" infile "{}" format "raw" }}"""
LISTENS = Entry("core", "core", "s3", "entered", "listen")
TAKES_IT = Entry("core", "core", "s4", "entered", "keyword")
ASKS = Entry("core", "core", "s9", "message", "core->ALSpeechRecognition subscribe")


class Robot:
    """Tells what comes next in `answers` after each recording that is played to it."""

    def __init__(self, answers: list[list[Entry]]) -> None:
        self.answers = answers
        self.played: list[tuple[str, int]] = []  # name and samples of each recording
        self._told: asyncio.Queue[Entry] = asyncio.Queue()

    async def follow(self, _bridge: str) -> AsyncIterator[Entry]:
        yield LISTENS
        while True:
            yield await self._told.get()

    async def play(self, _person: Person, recording: Path) -> None:
        self.played.append((recording.name, len(soundfile.read(recording)[0])))
        for entry in self.answers.pop(0):
            self._told.put_nowait(entry)


@pytest.fixture
def home(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Home:
    """A home that is up, with somebody's voice at its microphone `talker`."""
    home = Home(tmp_path_factory.mktemp("x"))
    home.make()
    home.keep(Settings("nao", None, None, None, (), {"rosbridge": 1, "nao_sim": 1}))
    noise = np.random.default_rng(3).normal(0, 30, 4 * RATE)
    noise[RATE : 2 * RATE] *= 100
    (home.folder / "talk.raw").write_bytes(noise.astype("<i2").tobytes())
    (home.folder / ".asoundrc").write_text(DEVICE.format(home.folder / "talk.raw"))
    monkeypatch.setenv("HOME", str(home.folder))
    monkeypatch.setattr(Supervisor, "runs", lambda _self: True)
    return home


def listen(home: Home, robot: Robot, monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    async def nothing(_person: Person) -> None:
        pass

    monkeypatch.setattr(conversation, "follow", robot.follow)
    monkeypatch.setattr(Person, "enter", nothing)
    monkeypatch.setattr(Person, "leave", nothing)
    monkeypatch.setattr(Person, "play", lambda person, recording: robot.play(person, recording))
    return main(["listen", "--home", str(home.folder), "--timeout", "60", *words])


def test_recordings_are_played_one_after_the_other_as_the_robot_asks(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    files = [home.folder / "mail.wav", home.folder / "name.wav"]
    for number, file in enumerate(files, 1):
        soundfile.write(file, np.zeros(number * 100), RATE)
    robot = Robot([[TAKES_IT, ASKS], [LISTENS]])
    assert listen(home, robot, monkeypatch, "--file", *map(str, files)) == 0
    assert robot.played == [("mail.wav", 100), ("name.wav", 200)]
    assert '"detail": "(name.wav)"' in home.timeline.read_text()


def test_a_file_that_is_no_sound_is_refused_before_anything_is_played(
    home: Home, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = Robot([])
    assert listen(home, robot, monkeypatch, "--file", str(home.folder / "talk.raw")) == 2
    assert "give a sound file" in capsys.readouterr().err


def test_the_microphone_is_asked_for_as_long_as_the_robot_asks(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot([[TAKES_IT, ASKS], [ASKS], [LISTENS]])
    assert listen(home, robot, monkeypatch, "--device", "talker") == 0
    assert [name for name, _ in robot.played] == ["spoken.wav"] * 3
    assert all(count > RATE for _, count in robot.played)
    assert not (home.folder / "spoken.wav").exists()


def test_without_a_microphone_it_ends_with_1_and_says_the_next_step(
    home: Home, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = Robot([])
    assert listen(home, robot, monkeypatch, "--device", "nowhere") == 1
    assert "cannot record from nowhere" in (said := capsys.readouterr().err)
    assert "--file WAV" in said
