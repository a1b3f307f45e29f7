"""The story of the demo as the person lives it: ask, give the name, speak the message, repeat when not understood."""

import asyncio
from dataclasses import dataclass

from rapp_cli.errors import CommandError
from rapp_cli.person import Person
from rapp_cli.timeline import Timeline

THINKING = 0.6  # s, between hearing the robot and answering: people do not answer at once, and recognisers start up
PATIENCE = 15.0  # s without an answer after which the person asks again
ASKS = 4  # how often the person asks before giving up


@dataclass(frozen=True)
class Lines:
    """What the person says, in this order."""

    command: str
    recipient: str
    message: str


async def live(person: Person, lines: Lines, timeline: Timeline) -> None:
    """Ask for the RApp and answer it until the robot listens again; raises CommandError when it never understands."""
    listening = await timeline.wait_for("core", "entered", "s3")
    for _ in range(ASKS):
        await asyncio.sleep(THINKING)
        await person.say(lines.command)
        try:
            started = await asyncio.wait_for(timeline.wait_for("core", "entered", "s9", listening), PATIENCE)
            break
        except TimeoutError:
            continue
    else:
        raise CommandError(f"cannot get the robot to start a RApp for “{lines.command}”; see the timeline above")
    answering = asyncio.create_task(_answer(person, lines))
    try:
        await timeline.wait_for("core", "entered", "s3", started)
    finally:
        answering.cancel()


async def _answer(person: Person, lines: Lines) -> None:
    """Say the recipient's name or the message, whichever the robot has just asked for."""
    while True:
        heard = (await person.next_heard()).lower()
        if "recording message" in heard:
            reply = lines.message
        elif "recognition" in heard or "again" in heard:
            reply = lines.recipient
        else:
            continue
        await asyncio.sleep(THINKING)
        await person.say(reply)
