"""`./rapp demo`: starts everything, lets the story happen, shows it live, and judges it by the mail that arrived."""

import argparse
import asyncio
import contextlib
import signal
import sys
from collections.abc import Coroutine
from typing import Any

from rapp_cli.demo import mailbox
from rapp_cli.demo.config import DemoConfig, add_options, read
from rapp_cli.demo.story import Lines, live
from rapp_cli.demo.system import System, running_system
from rapp_cli.errors import CommandError
from rapp_cli.person import Person
from rapp_cli.timeline import Entry, Timeline, follow

__all__ = ["add_options", "run"]

ENOUGH = 0.6  # share of the message's words that must be heard again; the recogniser's own error is about 0.15


def run(options: argparse.Namespace) -> int:
    """Run the demo; 0 only when the mail arrived with the spoken message in it."""
    config = read(options)
    return asyncio.run(_interruptible(_demo(config)))


async def _interruptible(work: Coroutine[Any, Any, int]) -> int:
    """SIGTERM ends like Ctrl-C: by cancelling, so that every child is ended on the way out."""
    task = asyncio.create_task(work)
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    try:
        return await task
    except asyncio.CancelledError:
        print("rapp demo: interrupted; every process is ended", file=sys.stderr)
        return 130


async def _demo(config: DemoConfig) -> int:
    config.folder.mkdir(parents=True, exist_ok=True)
    print(f"rapp demo: everything of this run is in {config.folder}", flush=True)
    async with running_system(config) as system:
        timeline = Timeline(record=config.folder / "timeline.jsonl")
        following = asyncio.create_task(_show(system.bridge, timeline))
        try:
            async with asyncio.timeout(config.timeout):
                await _unless_something_ends(_story(config, system, timeline), system, following)
                return await _judge(config, system, timeline)
        except TimeoutError:
            raise CommandError(f"cannot finish within {config.timeout:.0f} s; the logs are in {system.logs}") from None
        finally:
            following.cancel()


async def _show(bridge: str, timeline: Timeline) -> None:
    async for entry in follow(bridge):
        await timeline.add(entry)


async def _unless_something_ends(story: Coroutine[Any, Any, None], system: System, following: asyncio.Task[None]) -> None:
    """Run the story; a process that ends, or a silent bridge, ends it with a clear error."""
    telling = asyncio.create_task(story)
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


async def _story(config: DemoConfig, system: System, timeline: Timeline) -> None:
    if config.robot is not None:
        print("rapp demo: a real robot: you are the person; say “e-mail” when it is ready", flush=True)
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
        await live(person, Lines(config.command, config.recipient, config.message), timeline)
    finally:
        await person.leave()


async def _judge(config: DemoConfig, system: System, timeline: Timeline) -> int:
    if config.mail is not None:
        accepted = any(e.kind == "message" and "delivered" in e.detail for e in timeline.entries)
        print(f"rapp demo: {config.mail.host} {'accepted the mail' if accepted else 'has not accepted a mail'}")
        return 0 if accepted else 1
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(5):
            delivered = await mailbox.wait_for_mail(system.maildir, config.folder / "received")
            return await _judge_words(config, delivered)
    print(f"rapp demo: no mail arrived in {system.maildir}; the logs are in {system.logs}", file=sys.stderr)
    return 1


async def _judge_words(config: DemoConfig, delivered: mailbox.Delivered) -> int:
    heard = await asyncio.to_thread(mailbox.transcribe, delivered.recording)
    said = mailbox.words_heard(config.message, config.message)
    found = mailbox.words_heard(config.message, heard)
    print(f"\nmail       {delivered.mail}  (to {delivered.recipient})")
    print(f"recording  {delivered.recording}  ({len(found)} of {len(said)} words heard again: “{heard}”)")
    if config.robot is not None or len(found) >= ENOUGH * len(said):
        return 0
    print("rapp demo: the recording does not hold the spoken message", file=sys.stderr)
    return 1
