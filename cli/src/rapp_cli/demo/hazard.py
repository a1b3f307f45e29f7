"""The story of hazard_detection: somebody asks whether everything is safe; what the robot says is compared with the room."""

import asyncio
import email
import math
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from email.policy import default
from pathlib import Path

from rapp_cli.demo import mailbox
from rapp_cli.demo.config import DemoConfig
from rapp_cli.demo.story import converse
from rapp_cli.demo.system import System
from rapp_cli.person import Person
from rapp_cli.timeline import Timeline

CLOSED = 5.0  # degrees up to which a door counts as closed
ROUNDED = 7.0  # degrees that what is said may be beside the truth: it is said in tens
ON = 0.5  # level from which the lamp counts as on
MAIL = 10.0  # s that a mail may take after the robot has said that it is sent
INWARDS = -1.0  # sign of the angle by which the room's door opens into it


@dataclass(frozen=True)
class Truth:
    """What is so in the room: door in degrees, lamp from 0 to 1."""

    door: float
    lamp: float

    @property
    def safe(self) -> bool:
        """Whether nothing is open or on."""
        return self.door <= CLOSED and self.lamp < ON

    def __str__(self) -> str:
        return f"door {self.door:.0f} degrees open, lamp {'on' if self.lamp >= ON else 'off'}"


class Hazard:
    """See `story.Story`."""

    def __init__(self, config: DemoConfig, system: System) -> None:
        self._config = config
        self._system = system
        self._old = mailbox.mails(system.maildir)  # of a run before, in the same folder
        self._truth: Truth | None = None
        self._touched: list[str] = []

    async def live(self, person: Person, timeline: Timeline) -> None:
        """Leave door and lamp as wished, ask, answer whether to write; see how the room then is."""
        await person.ask_room("setDoor", INWARDS * math.radians(self._config.door))
        await person.ask_room("setLamp", float(self._config.light))
        if self._config.start:
            await person.ask_room("startAt", self._config.start)
        await person.ask_room("takeTouched")
        await converse(person, self._config.command, timeline, self._reply)
        self._truth = Truth(abs(math.degrees(await person.ask_room("getDoor"))), await person.ask_room("getLamp"))
        self._touched = await person.ask_room("takeTouched")

    def _reply(self, heard: str) -> str | None:
        """Yes or no to the robot's question."""
        if "shall I write" not in heard:
            return None
        return "yes" if self._config.write else "no"

    async def judge(self, timeline: Timeline) -> int:
        """0 only when what was said of door and lamp is so, a mail has come if one was asked for, and nothing was touched."""
        said = [entry.detail for entry in timeline.entries if entry.kind == "said" and entry.agent != "person"]
        if self._truth is None:
            print(f"\nsaid       {said[-1] if said else 'nothing'}")
            return 0 if any("the door is" in text and "the lamp is" in text for text in said) else 1
        wanted = self._config.write and not self._truth.safe
        mails = await self._mails(MAIL if wanted else 0.0)
        wrong = [*contradictions(said, self._truth), *_mail_wrong(mails, self._truth, wanted)]
        wrong += [f"it has touched {', '.join(self._touched)}"] if self._touched else []
        print(f"\nroom       {self._truth}")
        print(f"said       {_answer_of(said) or 'nothing of door and lamp'}")
        print(f"mail       {mails[0] if mails else 'none'}")
        if wrong:
            print(f"rapp demo: {'; '.join(wrong)}; the logs are in {self._system.logs}", file=sys.stderr)
        return 1 if wrong else 0

    async def _mails(self, patience: float) -> list[Path]:
        """The new mails to the recipient, once there is one."""
        loop = asyncio.get_running_loop()
        until = loop.time() + patience
        while True:
            new = [mail for mail in mailbox.mails(self._system.maildir) if mail not in self._old]
            found = [mail for mail in new if self._config.address in mail.read_text(errors="replace")]
            if found or loop.time() >= until:
                return found
            await asyncio.sleep(0.1)


def contradictions(said: Sequence[str], truth: Truth) -> list[str]:
    """What was said otherwise than it is, or not at all."""
    answer = _answer_of(said)
    opened = re.search(r"the door is open by about (\d+) degrees", answer)
    told = float(opened[1]) if opened else 0.0 if "the door is closed" in answer else None
    wrong = []
    if told is None:
        wrong.append("the robot has not said how the door is")
    elif (told > 0) != (truth.door > CLOSED) or (told > 0 and abs(told - truth.door) > ROUNDED):
        wrong.append(f"the door is said to be {f'{told:.0f} degrees open' if told else 'closed'}")
    lamp = re.search(r"the lamp is (on|off)", answer)
    if lamp is None:
        wrong.append("the robot has not said how the lamp is")
    elif (lamp[1] == "on") != (truth.lamp >= ON):
        wrong.append(f"the lamp is said to be {lamp[1]}")
    return wrong


def _answer_of(said: Sequence[str]) -> str:
    """The last that was said of both."""
    return next((text for text in reversed(said) if "the door" in text and "the lamp" in text), "")


def _mail_wrong(mails: Sequence[Path], truth: Truth, wanted: bool) -> list[str]:
    if len(mails) != int(wanted):
        return [f"{len(mails)} mails have come in place of {int(wanted)}"]
    texts = [email.message_from_bytes(mail.read_bytes(), policy=default).get_body(("plain",)) for mail in mails]
    return [f"in the mail {wrong}" for text in texts for wrong in contradictions([text.get_content() if text else ""], truth)]
