"""Speaking with the simulated robot: somebody says one thing after another, and all that the agents publish is shown."""

import asyncio
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass

from tornado.websocket import WebSocketError

from rapp_cli.errors import CommandError
from rapp_cli.home.place import Home
from rapp_cli.home.supervisor import Supervisor
from rapp_cli.person import Person
from rapp_cli.timeline import Entry, Timeline, append, follow

THINKING = 0.6  # s between the robot's question and the answer: recognisers start up
REACTION = 6.0  # s after the end of speech within which the robot reacts to what it has understood
LISTENS = "s3"
SERVES = "s9"
QUESTIONS = ("core->ALSpeechRecognition subscribe", "core->ALAudioRecorder startMicrophonesRecording")
"""Messages that begin a core service in which the robot listens for an answer."""


@dataclass(frozen=True)
class Utterance:
    """One thing to say: `speak` says it in the robot's room, and returns when that is done."""

    words: str  # for the timeline
    speak: Callable[[Person], Awaitable[None]]


def room_of(home: Home) -> None:
    """Check that there is a room in which one can speak to the robot. Raises CommandError."""
    settings = home.settled()
    if settings.robot is not None:
        raise CommandError(f"cannot speak to the real robot at {settings.robot} from here: speak to it yourself")
    if not Supervisor(home).runs():
        raise CommandError(f"cannot speak to the robot: it is not up; start it with {home.command('up')}")


async def converse(home: Home, utterances: AsyncIterator[Utterance], voice: str, timeout: float, *, endless: bool = False) -> int:
    """Say all of them, each one when the robot listens; gives 0 once it listens again, 1 when it does not react to a command.

    With `endless`, go on while a RApp asks for answers. Raises CommandError.
    """
    settings = home.settled()
    person = Person(settings.naoqi, voice)
    timeline = Timeline()
    following = asyncio.create_task(_show(settings.bridge, timeline))
    talk = _Talk(home, person, timeline)
    try:
        async with asyncio.timeout(timeout):
            await person.enter()
            return await _unless_lost(talk.go_on(utterances, endless=endless), following)
    except TimeoutError:
        raise CommandError(f"cannot go on: the robot does not listen after {timeout:g} s; see {home.command('log')}") from None
    finally:
        following.cancel()
        await person.leave()


async def _show(bridge: str, timeline: Timeline) -> None:
    try:
        async for entry in follow(bridge):
            await timeline.add(entry)
    except (OSError, WebSocketError) as error:
        raise CommandError(f"cannot reach {bridge}: {error}; see ./rapp status") from error


async def _unless_lost(talking: Awaitable[int], following: "asyncio.Task[None]") -> int:
    talk = asyncio.ensure_future(talking)
    try:
        await asyncio.wait({talk, following}, return_when=asyncio.FIRST_COMPLETED)
        if not talk.done():
            following.result()
            raise CommandError("cannot go on: the rosbridge has left; see ./rapp status")
        return talk.result()
    finally:
        talk.cancel()


class _Talk:
    """What has been said, and what the robot has done about it."""

    def __init__(self, home: Home, person: Person, timeline: Timeline) -> None:
        self._home = home
        self._person = person
        self._timeline = timeline
        self._seen = 0  # entries of the timeline

    async def go_on(self, utterances: AsyncIterator[Utterance], *, endless: bool) -> int:
        """See `converse`."""
        asked = await self._until_it_may_hear()
        async for utterance in utterances:
            self._seen = len(self._timeline.entries)
            await self._say(utterance)
            if not asked and not await self._reacts():
                print(f"rapp: the robot has not understood “{utterance.words}”; say it again", file=sys.stderr)
                return 1
            asked = await self._until_it_listens()
            if endless and not asked:
                return 0
            await asyncio.sleep(THINKING)
        if asked:
            print(f"rapp: the robot waits for an answer: {self._home.command('say ANSWER')}")
        return 0

    async def _until_it_may_hear(self) -> bool:
        """Wait until the robot listens; gives whether a RApp runs, which may have asked something."""
        entry = await self._next()
        if entry.agent == "dynamic" or entry.state.partition("/")[0] == SERVES:
            return True
        return False if entry.state == LISTENS else await self._until_it_listens()

    async def _until_it_listens(self) -> bool:
        """Wait until the robot listens, for a command or for an answer; gives whether it is for an answer."""
        while True:
            entry = await self._next()
            if (entry.agent, entry.kind, entry.state) == ("core", "entered", LISTENS):
                return False
            if entry.kind == "message" and entry.state == SERVES and entry.detail.startswith(QUESTIONS):
                return True

    async def _reacts(self) -> bool:
        """Wait for a sign that the robot has understood a command; gives False when there is none in time."""
        try:
            async with asyncio.timeout(REACTION):
                while True:
                    entry = await self._next()
                    if entry.agent == "core" and (entry.kind in ("heard", "failed") or entry.state != LISTENS):
                        return True
        except TimeoutError:
            return False

    async def _say(self, utterance: Utterance) -> None:
        entry = Entry("person", "", "", "said", utterance.words)
        append(self._home.timeline, entry)
        await self._timeline.add(entry)
        await utterance.speak(self._person)

    async def _next(self) -> Entry:
        entry = await self._timeline.entry(self._seen)
        self._seen += 1
        return entry
