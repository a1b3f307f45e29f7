"""The demo's judgement of hazard_detection: what was said against what is, the mail, nothing touched."""

import asyncio
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rapp_cli.demo.config import HAZARD, DemoConfig
from rapp_cli.demo.hazard import Hazard, Truth, contradictions
from rapp_cli.timeline import Entry, Timeline

OPEN = "the door is open by about 40 degrees, and the lamp is on; please see to it"
SAFE = "everything is safe, the door is closed, and the lamp is off"
ADDRESS = "elizabeth@home.example"


@pytest.mark.parametrize(
    ("said", "truth", "wrong"),
    [
        (SAFE, Truth(0, 0), ""),
        (OPEN, Truth(40, 1), ""),
        (OPEN, Truth(44, 1), ""),
        (OPEN, Truth(50, 1), "the door is said to be 40 degrees open"),
        (OPEN, Truth(0, 1), "the door is said to be 40 degrees open"),
        (OPEN, Truth(40, 0), "the lamp is said to be on"),
        (SAFE, Truth(10, 0), "the door is said to be closed"),
        (SAFE, Truth(0, 0.9), "the lamp is said to be off"),
        ("I am not sure about the door, and the lamp is on", Truth(0, 1), "has not said how the door is"),
        ("the door is closed, and I am not sure about the lamp", Truth(0, 1), "has not said how the lamp is"),
        ("I cannot reach my cloud agent", Truth(0, 0), "has not said how the door is"),
    ],
)
def test_only_what_is_so_is_right(said: str, truth: Truth, wrong: str) -> None:
    found = contradictions(["I look whether everything is safe", said, "I write to nobody"], truth)
    assert wrong in "; ".join(found)
    assert bool(found) == bool(wrong)


class Room:
    """A person in a room whose robot says some texts."""

    def __init__(self, timeline: Timeline, said: str, touched: list[str]) -> None:
        self.asked: list[tuple[str, tuple[Any, ...]]] = []
        self.replies: list[str] = []
        self._timeline, self._said, self._touched = timeline, said, [[], touched]
        self._heard: asyncio.Queue[str] = asyncio.Queue()
        self._set: dict[str, float] = {}

    async def ask_room(self, method: str, *values: Any) -> Any:
        self.asked.append((method, values))
        if method.startswith("set"):
            self._set[method[3:]] = values[0]
        return self._touched.pop(0) if method == "takeTouched" else self._set.get(method[3:])

    async def next_heard(self) -> str:
        return await self._heard.get()

    def forget(self) -> None:
        assert self._heard.empty()

    async def say(self, text: str) -> None:
        if text in ("yes", "no"):
            self.replies.append(text)
            await self._timeline.add(Entry("core", "core", "s3", "entered", ""))
            return
        await self._timeline.add(Entry("core", "core", "s9", "entered", ""))
        await self._timeline.add(Entry("core", "core", "s9", "said", self._said))
        self._heard.put_nowait("shall I write to Elizabeth? please say yes or no")


def judged(folder: Path, said: str, mails: Sequence[str] = (), touched: Sequence[str] = (), **wishes: Any) -> tuple[int, Room]:
    config = DemoConfig(
        story=HAZARD, folder=folder, command="is everything safe", recipient="", message="", voice="", robot=None, cloud=None,
        mail=None, address=ADDRESS, timeout=1.0, obstacle=False, silent=True, **wishes,
    )  # fmt: skip

    def put(name: str, text: str) -> None:
        (folder / "new").mkdir(exist_ok=True)
        (folder / "new" / name).write_text(f"To: {ADDRESS}\nSubject: safe?\n\n{text}\n")

    put("of a run before", OPEN)

    async def story() -> tuple[int, Room]:
        timeline = Timeline()
        await timeline.add(Entry("core", "core", "s3", "entered", ""))
        room = Room(timeline, said, list(touched))
        hazard = Hazard(config, SimpleNamespace(maildir=folder, logs=folder))  # type: ignore[arg-type]
        await hazard.live(room, timeline)  # type: ignore[arg-type]
        for number, text in enumerate(mails):
            put(str(number), text)
        return await hazard.judge(timeline), room

    return asyncio.run(story())


def test_door_and_lamp_are_as_wished_and_the_question_is_answered(tmp_path: Path) -> None:
    status, room = judged(tmp_path, OPEN, start="table")
    assert status == 0
    assert room.asked[:3] == [("setDoor", (pytest.approx(-0.698, abs=1e-3),)), ("setLamp", (1.0,)), ("startAt", ("table",))]
    assert room.replies == ["no"]


def test_a_mail_that_was_asked_for_must_come_and_be_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, mails, wanted in (("right", [OPEN], 0), ("wrong", [SAFE], 1), ("two", [OPEN, OPEN], 1)):
        folder = tmp_path / name
        folder.mkdir()
        status, room = judged(folder, OPEN, mails, write=True)
        assert (status, room.replies) == (wanted, ["yes"])
    assert "in the mail the door is said to be closed" in capsys.readouterr().err


def test_a_mail_that_nobody_wanted_is_wrong(tmp_path: Path) -> None:
    assert judged(tmp_path, OPEN, [OPEN])[0] == 1


def test_what_was_touched_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert judged(tmp_path, OPEN, touched=["lamp"])[0] == 1
    assert "touched lamp" in capsys.readouterr().err


def test_a_wrong_answer_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert judged(tmp_path, SAFE)[0] == 1
    assert "the door is said to be closed; the lamp is said to be off" in capsys.readouterr().err
