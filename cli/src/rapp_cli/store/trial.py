"""`./rapp run DIR`: tries a RApp on a simulated robot of its own, with a platform that offers nothing else."""

import argparse
import asyncio
import io
from dataclasses import replace
from pathlib import Path

from rapp_cli.demo import config as demo
from rapp_cli.demo.story import ask
from rapp_cli.demo.system import System, running_system
from rapp_cli.errors import CommandError, UsageError
from rapp_cli.person import Person
from rapp_cli.processes import interruptible
from rapp_cli.store.place import told
from rapp_cli.store.publish import parts
from rapp_cli.timeline import Entry, Timeline, follow
from rapp_core.robot.naoqi.voice import LANGUAGES
from rapp_hop.hz.archive import build, inspect
from rapp_hop.hz.manifest import Manifest
from rapp_nao_sim.sound.synthesis import languages

CORE = "core"
ENGLISH = "en"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp run`."""
    parser.description = "Runs a RApp once on a simulated robot that is fed with text and speaks without sound."
    parser.add_argument("folder", type=Path, help="with package.json; of a four-agent RApp, with dynamic/ and cloud/")
    parser.add_argument("--answer", action="append", default=[], metavar="TEXT", help="say this when the robot has spoken; repeat")
    parser.add_argument("--say", metavar="TEXT", help="a keyword or an English sentence (its first keyword, else sentence)")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds for all of it (%(default)g)")


@told
def run(options: argparse.Namespace) -> int:
    """Run it; 0 when it has ended well."""
    folders = parts(options.folder)
    manifest = next(found for found in map(_manifest, folders) if found.agent == "dynamic")
    command, language = _request(manifest, options.say)
    words = argparse.ArgumentParser()
    demo.add_options(words)
    config = replace(demo.read(words.parse_args([]), {}), command=command, silent=True, timeout=options.timeout)
    if language != ENGLISH:
        config = replace(config, language=language, voice=_voice(language))
    return asyncio.run(interruptible(_try(config, folders, options.answer), "run"))


def _request(manifest: Manifest, wanted: str | None) -> tuple[str, str]:
    """What the person says, and its language: a keyword before a sentence, which the platform interprets in English only.

    Raises UsageError when the robot would hear neither.
    """
    sentences = manifest.sentences.get(ENGLISH, ())
    spoken = [language for language in manifest.keywords if language != ENGLISH and _voice(language)]
    keywords = {text: language for language in [*spoken, ENGLISH] for text in manifest.keywords.get(language, ())}
    if wanted is None:
        wanted = next(iter([*manifest.keywords.get(ENGLISH, ()), *sentences, *keywords]), "")
    if wanted in keywords or (wanted and sentences):
        return wanted, keywords.get(wanted, ENGLISH)
    what = f"by {wanted!r}" if wanted else "by anything that the simulated person can say"
    raise UsageError(f"cannot try {manifest.name}: it is not asked for {what}; give it a keyword, or an English sentence")


def _voice(language: str) -> str:
    """The voice of espeak-ng for a language that the robot knows, too; "": there is none."""
    return languages().get(LANGUAGES.get(language, ""), "")


def _manifest(folder: Path) -> Manifest:
    return inspect(io.BytesIO(build(folder))).manifest


async def _try(config: demo.DemoConfig, folders: list[Path], answers: list[str]) -> int:
    config.folder.mkdir(parents=True, exist_ok=True)
    print(f"rapp run: everything of this run is in {config.folder}", flush=True)
    async with running_system(config, folders) as system:
        timeline = Timeline(record=config.folder / "timeline.jsonl")
        following = asyncio.create_task(_show(system, timeline))
        try:
            async with asyncio.timeout(config.timeout):
                entries = await _once(config, system, timeline, answers)
        except TimeoutError:
            raise CommandError(f"cannot finish within {config.timeout:.0f} s; the logs are in {system.logs}") from None
        finally:
            following.cancel()
    return _judge(entries, config.folder / "robot" / "logs")


async def _once(config: demo.DemoConfig, system: System, timeline: Timeline, answers: list[str]) -> list[Entry]:
    """What happens from the robot's understanding the command until it listens again."""
    person = Person(system.robot, config.voice)
    await person.enter()
    answering: asyncio.Task[None] | None = None
    try:
        heard = await ask(person, config.command, timeline, until="s6")
        answering = asyncio.create_task(_answer(person, answers))
        await timeline.wait_for(CORE, "entered", "s3", heard)
    finally:
        if answering is not None:
            answering.cancel()
        await person.leave()
    return timeline.entries[heard:]


async def _answer(person: Person, answers: list[str]) -> None:
    for text in answers:
        await person.next_heard()
        await person.say(text)


def _judge(entries: list[Entry], logs: Path) -> int:
    """Its own failure comes first; a RApp that cannot tell of it, as one that is killed, is known by the robot's apology."""
    failed = [entry for entry in entries if entry.kind == "failed"] or [
        entry for entry in entries if (entry.agent, entry.kind, entry.state) == (CORE, "said", "s11")
    ]
    if failed:
        print(f"rapp run: FAILED in {failed[0].state}: {failed[0].detail}; what it wrote is in {logs}", flush=True)
        return 1
    print("rapp run: it has ended well", flush=True)
    return 0


async def _show(system: System, timeline: Timeline) -> None:
    async for entry in follow(system.bridge):
        await timeline.add(entry)
