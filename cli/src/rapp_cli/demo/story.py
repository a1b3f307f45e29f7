"""What the stories of the demo have in common: a person asks for a RApp, and it is judged by what it has left."""

import asyncio
from collections.abc import Callable
from typing import Protocol

from rapp_cli.errors import CommandError
from rapp_cli.person import Person
from rapp_cli.timeline import Timeline

THINKING = 0.6  # s, between hearing the robot and answering: people do not answer at once, and recognisers start up
PATIENCE = 15.0  # s without an answer after which the person asks again
ASKS = 4  # how often the person asks before giving up
Reply = Callable[[str], str | None]  # what the person says to what the robot has said; None: nothing


class Story(Protocol):
    """One story."""

    async def live(self, person: Person, timeline: Timeline) -> None:
        """Be the person, until the robot listens again. Raises CommandError."""

    async def judge(self, timeline: Timeline) -> int:
        """Tell what was left, on the terminal; gives the exit status. With a real robot, `live` has not been called."""


async def ask(person: Person, command: str, timeline: Timeline, until: str = "s9") -> int:
    """Ask for a RApp until the core agent enters a state; gives the index behind that in the timeline.

    Raises CommandError when it never does.
    """
    listening = await timeline.wait_for("core", "entered", "s3")
    for _ in range(ASKS):
        await asyncio.sleep(THINKING)
        person.forget()  # that the robot is ready asks nothing
        await person.say(command)
        try:
            return await asyncio.wait_for(timeline.wait_for("core", "entered", until, listening), PATIENCE)
        except TimeoutError:
            continue
    raise CommandError(f"cannot get the robot to start a RApp for “{command}”; see the timeline above")


async def converse(person: Person, command: str, timeline: Timeline, reply: Reply) -> None:
    """Ask for a RApp, and reply to the robot until it listens again. Raises CommandError when it is never understood."""
    started = await ask(person, command, timeline)
    replying = asyncio.create_task(_reply(person, reply))
    try:
        await timeline.wait_for("core", "entered", "s3", started)
    finally:
        replying.cancel()


async def _reply(person: Person, reply: Reply) -> None:
    while True:
        words = reply(await person.next_heard())
        if words is not None:
            await asyncio.sleep(THINKING)
            await person.say(words)
