"""./rapp run: how a RApp that is tried has ended, whenever and however it fails, and whether it can tell of it or not."""

import argparse
import asyncio
import json
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fakes.packages import manifest
from rapp_cli.errors import UsageError
from rapp_cli.person import Person
from rapp_cli.store import new, trial
from rapp_cli.timeline import Entry
from rapp_hop.hz.manifest import parse_manifest

Told = tuple[str, str, str, str]
LISTENS = [("core", "s3", "entered", "listen")]
HEARS = [("core", "s3", "heard", "greeter"), ("core", "s4", "entered", "keyword"), ("core", "s6", "entered", "download")]
STARTS = [("core", "s8", "entered", "await first word"), ("dynamic", "s2", "entered", "initialise")]
RUNS = [("core", "s9", "entered", "await and execute commands")]
FAILS = [("dynamic", "execute", "failed", "ValueError: boom")]


def apology(text: str) -> list[Told]:
    return [("core", "s11", "entered", "say what failed"), ("core", "s11", "said", text)]


class Silent(Person):
    """Hears that the robot is ready, then what a RApp asks once its keyword is said; only the right moment's answer counts."""

    def __init__(self, seen: asyncio.Queue[Told], happens: list[Told], asks: str, answers: Sequence[str]) -> None:
        super().__init__("", "")
        self._seen, self._happens, self._asks, self._answers = seen, happens, asks, answers
        self._asked = False

    async def enter(self) -> None:
        self._hear("I am ready")
        self._tell(LISTENS)

    async def say(self, text: str) -> None:
        if text in self._answers:
            assert self._asked
        else:
            self._tell(HEARS)
        if text in self._answers or not self._asks:
            self._tell([*self._happens, *LISTENS])
        else:
            asyncio.get_running_loop().call_later(0.05, self._ask)

    def _ask(self) -> None:
        self._asked = True
        self._hear(self._asks)

    def _tell(self, entries: list[Told]) -> None:
        for entry in entries:
            self._seen.put_nowait(entry)

    async def leave(self) -> None:
        pass


def tried(folder: Path, monkeypatch: pytest.MonkeyPatch, happens: list[Told], asks: str = "", answers: Sequence[str] = ()) -> int:
    """What `./rapp run` gives for a new RApp when this happens once its keyword is said, and what it asks is answered."""
    new.run(argparse.Namespace(name="greeter", javascript=False, folder=folder))
    seen: asyncio.Queue[Told] = asyncio.Queue()

    async def follow(_bridge: str) -> AsyncIterator[Entry]:
        while True:
            agent, state, kind, detail = await seen.get()
            yield Entry(agent, agent, state, kind, detail)

    @asynccontextmanager
    async def running_system(*_: Any) -> AsyncIterator[SimpleNamespace]:
        yield SimpleNamespace(robot="", bridge="", logs=folder)

    monkeypatch.setenv("XDG_DATA_HOME", str(folder / "data"))
    monkeypatch.setattr(trial, "Person", lambda *_: Silent(seen, happens, asks, answers))
    monkeypatch.setattr(trial, "follow", follow)
    monkeypatch.setattr(trial, "running_system", running_system)
    words = argparse.Namespace(folder=folder / "greeter", say=None, answer=list(answers), timeout=60.0)
    return trial.run(words)


@pytest.mark.parametrize(
    ("happens", "told"),
    [
        ([*STARTS, *FAILS, *RUNS, *apology("It has failed")], "FAILED in execute: ValueError: boom"),  # before s9
        ([*STARTS, *RUNS, *FAILS, *apology("It has failed")], "FAILED in execute: ValueError: boom"),
        ([*STARTS, *apology("It did not start")], "FAILED in s11: It did not start"),
        ([*STARTS, *RUNS, *apology("It hangs")], "FAILED in s11: It hangs"),
    ],
)
def test_a_rapp_that_fails_is_not_said_to_have_ended_well(
    happens: list[Told],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert tried(tmp_path, monkeypatch, happens) == 1
    last = capsys.readouterr().out.splitlines()[-1]
    assert told in last
    assert last.endswith("/robot/logs")


def test_one_that_does_what_it_shall_has_ended_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert tried(tmp_path, monkeypatch, [*STARTS, *RUNS]) == 0
    assert capsys.readouterr().out.endswith("rapp run: it has ended well\n")


def test_an_answer_is_for_the_rapp_and_not_for_a_robot_that_is_ready(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert tried(tmp_path, monkeypatch, [*STARTS, *RUNS], asks="what is your name?", answers=["Eva"]) == 0


KEYWORD, SENTENCE, POLISH = {"en": ["hi", "hello"]}, {"en": ["greet me please", "say hello"]}, {"pl": ["dzień dobry"]}


def request(keywords: dict[str, list[str]], sentences: dict[str, list[str]], wanted: str | None) -> tuple[str, str]:
    """What the person says for such a RApp, and in which language."""
    return trial._request(parse_manifest(json.dumps(manifest(keywords=keywords, sentences=sentences)).encode()), wanted)


@pytest.mark.parametrize(
    ("keywords", "sentences", "wanted", "said"),
    [
        ({**POLISH, **KEYWORD}, SENTENCE, None, ("hi", "en")),
        ({**POLISH, **KEYWORD}, SENTENCE, "hello", ("hello", "en")),
        (KEYWORD, SENTENCE, "say hello to all of us", ("say hello to all of us", "en")),
        ({}, SENTENCE, None, ("greet me please", "en")),
        (POLISH, SENTENCE, None, ("greet me please", "en")),
        (POLISH, SENTENCE, "dzień dobry", ("dzień dobry", "pl")),
        (POLISH, {}, None, ("dzień dobry", "pl")),
        ({"xx": ["blah"], **POLISH}, {"pl": ["proszę się przywitać"]}, None, ("dzień dobry", "pl")),
    ],
)
def test_what_can_be_published_can_be_tried(
    keywords: dict[str, list[str]], sentences: dict[str, list[str]], wanted: str | None, said: tuple[str, str]
) -> None:
    assert request(keywords, sentences, wanted) == said


@pytest.mark.parametrize(
    ("keywords", "sentences", "wanted"),
    [
        (KEYWORD, {}, "helo"),
        ({}, {"pl": ["proszę się przywitać"]}, None),
        ({"xx": ["blah"]}, {}, None),
        ({"xx": ["blah"]}, {}, "blah"),
    ],
)
def test_what_the_simulated_robot_cannot_hear_names_the_next_step(
    keywords: dict[str, list[str]], sentences: dict[str, list[str]], wanted: str | None
) -> None:
    with pytest.raises(UsageError, match="give it a keyword, or an English sentence"):
        request(keywords, sentences, wanted)
