"""The story of the paper: a person asks for voice-mail, names whom they write to, speaks; a mail arrives."""

import asyncio
import sys
from pathlib import Path

from rapp_cli.demo import mailbox
from rapp_cli.demo.config import DemoConfig
from rapp_cli.demo.story import converse
from rapp_cli.demo.system import System
from rapp_cli.person import Person
from rapp_cli.timeline import Timeline

ENOUGH = 0.6  # share of the message's words that must be heard again; the recogniser's own error is about 0.15

UNJUDGED = "rapp demo: a real robot: whether the recording holds what you have said is not judged"


class VoiceMail:
    """See `story.Story`."""

    def __init__(self, config: DemoConfig, system: System) -> None:
        self._config = config
        self._system = system
        self._old = mailbox.mails(system.maildir)  # of a run before, in the same folder
        self._recorded: Path | None = None  # a copy of what was sent by a real mail account

    async def live(self, person: Person, timeline: Timeline) -> None:
        """Ask for it, and answer it until the robot listens again."""
        await converse(person, self._config.command, timeline, self._reply)

    def _reply(self, heard: str) -> str | None:
        """The recipient's name or the message, whichever the robot has just asked for."""
        heard = heard.lower()
        if "sending" in heard and self._config.mail is not None:
            self._recorded = mailbox.keep_recording(self._config.folder / "robot" / "runs", self._config.folder / "received")
        if "recording message" in heard:
            return self._config.message
        return self._config.recipient if "recognition" in heard or "again" in heard else None

    async def judge(self, timeline: Timeline) -> int:
        """0 only when the mail arrived, at whom it was for, with the spoken message in it.

        At a real mail account: when its server has taken the mail, and the recording on the robot holds the message. What
        somebody has said to a real robot is not judged.
        """
        config, system = self._config, self._system
        if config.mail is not None:
            return await self._judge_sent(timeline)
        try:
            async with asyncio.timeout(5):
                delivered = await mailbox.wait_for_mail(system.maildir, config.folder / "received", self._old)
        except TimeoutError:
            return _wrong(f"no mail arrived in {system.maildir}; the logs are in {system.logs}")
        print(f"\nmail       {delivered.mail}  (to {delivered.recipient})")
        if config.robot is None and config.address and delivered.recipient.casefold() != config.address.casefold():
            return _wrong(f"the mail is to {delivered.recipient}, not to {config.address}")
        return await self._judge_words(delivered.recording)

    async def _judge_sent(self, timeline: Timeline) -> int:
        config = self._config
        assert config.mail is not None
        if not any(entry.kind == "message" and entry.detail.endswith("send_mail: delivered") for entry in timeline.entries):
            return _wrong(f"{config.mail.host} has not accepted a mail; the logs are in {self._system.logs}")
        print(f"\nmail       {config.mail.host} accepted it")
        if config.robot is not None:
            print(UNJUDGED)
            return 0
        heard = [entry.detail for entry in timeline.entries if (entry.agent, entry.kind) == ("core", "heard")]
        if not heard or heard[-1].casefold() != config.recipient.casefold():
            return _wrong(f"the mail is not to {config.recipient}: the robot has heard {' and '.join(heard) or 'nothing'}")
        if self._recorded is None:
            return _wrong("the recording could not be judged: the robot does not have it any more")
        return await self._judge_words(self._recorded)

    async def _judge_words(self, recording: Path) -> int:
        message = self._config.message
        heard = await asyncio.to_thread(mailbox.transcribe, recording)
        if self._config.robot is not None:
            print(f"recording  {recording}  (“{heard}”)\n{UNJUDGED}")
            return 0
        said = mailbox.words_heard(message, message)
        found = mailbox.words_heard(message, heard)
        print(f"recording  {recording}  ({len(found)} of {len(said)} words heard again: “{heard}”)")
        return 0 if len(found) >= ENOUGH * len(said) else _wrong("the recording does not hold the spoken message")


def _wrong(why: str) -> int:
    print(f"rapp demo: {why}", file=sys.stderr)
    return 1
