"""./rapp run: how a RApp that is tried has ended, whenever and however it fails, and whether it can tell of it or not."""

import argparse
import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rapp_cli.person import Person
from rapp_cli.store import new, trial
from rapp_cli.timeline import Entry

LISTENS = [("core", "s3", "entered", "listen")]
HEARS = [("core", "s3", "heard", "greeter"), ("core", "s4", "entered", "keyword")]
STARTS = [("core", "s8", "entered", "await first word"), ("dynamic", "s2", "entered", "initialise")]
RUNS = [("core", "s9", "entered", "await and execute commands")]
FAILS = [("dynamic", "execute", "failed", "ValueError: boom")]


def apology(text: str) -> list[tuple[str, str, str, str]]:
    return [("core", "s11", "entered", "say what failed"), ("core", "s11", "said", text)]


def tried(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    happens: list[tuple[str, str, str, str]],
    asks: str = "",
    answers: Sequence[str] = (),
) -> int:
    """What `./rapp run` gives for a new RApp when this happens once its keyword is said; what it asks must be answered first."""
    new.run(argparse.Namespace(name="greeter", javascript=False, folder=folder))
    seen: asyncio.Queue[tuple[str, str, str, str]] = asyncio.Queue()

    class Silent(Person):
        def __init__(self, *_: Any) -> None:
            super().__init__("", "")
            self._asked = ""  # what the robot has said last that wants an answer

        async def enter(self) -> None:
            self._hear("I am ready")
            for entry in LISTENS:
                seen.put_nowait(entry)

        async def say(self, text: str) -> None:
            if text in answers:
                assert self._asked == asks
                self._tell(happens)
                return
            assert not self._asked, "it was asked for once"
            for entry in HEARS:
                seen.put_nowait(entry)
            if asks:
                asyncio.get_running_loop().call_later(0.05, self._ask)
            else:
                self._tell(happens)

        def _ask(self) -> None:
            self._asked = asks
            self._hear(asks)

        def _tell(self, entries: list[tuple[str, str, str, str]]) -> None:
            for entry in [*entries, *LISTENS]:
                seen.put_nowait(entry)

        async def leave(self) -> None:
            pass

    async def follow(_bridge: str) -> AsyncIterator[Entry]:
        while True:
            agent, state, kind, detail = await seen.get()
            yield Entry(agent, agent, state, kind, detail)

    @asynccontextmanager
    async def running_system(*_: Any) -> AsyncIterator[SimpleNamespace]:
        yield SimpleNamespace(robot="", bridge="", logs=folder)

    monkeypatch.setenv("XDG_DATA_HOME", str(folder / "data"))
    monkeypatch.setattr(trial, "Person", Silent)
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
    happens: list[tuple[str, str, str, str]],
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
