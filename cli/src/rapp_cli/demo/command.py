"""`./rapp demo`: starts everything, lets a story happen, shows it live, and judges it by what it has left."""

import argparse
import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from rapp_cli.demo.config import HAZARD, SHOW_AROUND, VOICE_MAIL, DemoConfig, add_options, read
from rapp_cli.demo.hazard import Hazard
from rapp_cli.demo.show_around import ShowAround
from rapp_cli.demo.speech import check_speech
from rapp_cli.demo.story import Story
from rapp_cli.demo.system import System, running_system
from rapp_cli.demo.voice_mail import VoiceMail
from rapp_cli.errors import CommandError
from rapp_cli.person import Person
from rapp_cli.processes import interruptible
from rapp_cli.timeline import Entry, Timeline, follow

__all__ = ["add_options", "run"]

STORIES: dict[str, Callable[[DemoConfig, System], Story]] = {
    VOICE_MAIL: VoiceMail,
    SHOW_AROUND: ShowAround,
    HAZARD: Hazard,
}


def run(options: argparse.Namespace) -> int:
    """Run the demo; 0 only when the story has ended well."""
    config = read(options)
    if config.robot is None:
        check_speech(config)
    return asyncio.run(interruptible(_demo(config), "demo"))


async def _demo(config: DemoConfig) -> int:
    config.folder.mkdir(parents=True, exist_ok=True)
    print(f"rapp demo: everything of this run is in {config.folder}", flush=True)
    async with running_system(config) as system:
        story = STORIES[config.story](config, system)
        timeline = Timeline(record=config.folder / "timeline.jsonl")
        following = asyncio.create_task(_show(system.bridge, timeline))
        try:
            async with asyncio.timeout(config.timeout):
                await _unless_something_ends(_live(story, config, system, timeline), system, following)
                return await story.judge(timeline)
        except TimeoutError:
            raise CommandError(f"cannot finish within {config.timeout:.0f} s; the logs are in {system.logs}") from None
        finally:
            following.cancel()


async def _show(bridge: str, timeline: Timeline) -> None:
    async for entry in follow(bridge):
        await timeline.add(entry)


async def _unless_something_ends(living: Coroutine[Any, Any, None], system: System, following: asyncio.Task[None]) -> None:
    """Run the story; a process that ends, or a silent bridge, ends it with a clear error."""
    telling = asyncio.create_task(living)
    ending = asyncio.create_task(system.children.first_ended())
    try:
        await asyncio.wait({telling, ending, following}, return_when=asyncio.FIRST_COMPLETED)
        if not telling.done() and ending.done():
            raise CommandError(f"cannot go on: {ending.result().name} has ended\n{ending.result().tail()}")
        if not telling.done():
            raise CommandError(f"cannot go on: the agents' states come no longer; the logs are in {system.logs}")
        await telling
    finally:
        telling.cancel()
        ending.cancel()


async def _live(story: Story, config: DemoConfig, system: System, timeline: Timeline) -> None:
    if config.robot is not None:
        print(f"rapp demo: a real robot: you are the person; say “{config.command}” when it is ready", flush=True)
        running = await timeline.wait_for("core", "entered", "s9")
        await timeline.wait_for("core", "entered", "s3", running)
        return
    adding: set[asyncio.Task[None]] = set()

    def speaks(text: str) -> None:
        task = asyncio.create_task(timeline.add(Entry("person", "", "", "said", text)))
        adding.add(task)
        task.add_done_callback(adding.discard)

    person = Person(system.robot, config.voice, speaks)
    await person.enter()
    try:
        await story.live(person, timeline)
    finally:
        await person.leave()
