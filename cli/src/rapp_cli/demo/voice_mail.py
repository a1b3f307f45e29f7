"""The story of the paper: a person asks for voice-mail, names whom they write to, speaks; a mail arrives."""

import asyncio
import sys

from rapp_cli.demo import mailbox
from rapp_cli.demo.config import DemoConfig
from rapp_cli.demo.story import converse
from rapp_cli.demo.system import System
from rapp_cli.person import Person
from rapp_cli.timeline import Timeline

ENOUGH = 0.6  # share of the message's words that must be heard again; the recogniser's own error is about 0.15


class VoiceMail:
    """See `story.Story`."""

    def __init__(self, config: DemoConfig, system: System) -> None:
        self._config = config
        self._system = system

    async def live(self, person: Person, timeline: Timeline) -> None:
        """Ask for it, and answer it until the robot listens again."""
        await converse(person, self._config.command, timeline, self._reply)

    def _reply(self, heard: str) -> str | None:
        """The recipient's name or the message, whichever the robot has just asked for."""
        heard = heard.lower()
        if "recording message" in heard:
            return self._config.message
        return self._config.recipient if "recognition" in heard or "again" in heard else None

    async def judge(self, timeline: Timeline) -> int:
        """0 only when the mail arrived with the spoken message in it."""
        config, system = self._config, self._system
        if config.mail is not None:
            accepted = any(e.kind == "message" and "delivered" in e.detail for e in timeline.entries)
            print(f"rapp demo: {config.mail.host} {'accepted the mail' if accepted else 'has not accepted a mail'}")
            return 0 if accepted else 1
        try:
            async with asyncio.timeout(5):
                delivered = await mailbox.wait_for_mail(system.maildir, config.folder / "received")
        except TimeoutError:
            print(f"rapp demo: no mail arrived in {system.maildir}; the logs are in {system.logs}", file=sys.stderr)
            return 1
        return await self._judge_words(delivered)

    async def _judge_words(self, delivered: mailbox.Delivered) -> int:
        message = self._config.message
        heard = await asyncio.to_thread(mailbox.transcribe, delivered.recording)
        said = mailbox.words_heard(message, message)
        found = mailbox.words_heard(message, heard)
        print(f"\nmail       {delivered.mail}  (to {delivered.recipient})")
        print(f"recording  {delivered.recording}  ({len(found)} of {len(said)} words heard again: “{heard}”)")
        if self._config.robot is not None or len(found) >= ENOUGH * len(said):
            return 0
        print("rapp demo: the recording does not hold the spoken message", file=sys.stderr)
        return 1
