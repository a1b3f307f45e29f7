"""`./rapp listen`: what you say into this computer's microphone is played into the simulated robot's."""

import argparse
import asyncio
import functools
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

import numpy as np
import soundfile

from rapp_cli.errors import UsageError
from rapp_cli.home.conversation import Utterance, converse, room_of
from rapp_cli.home.microphone import hear
from rapp_cli.home.place import Home, add_home_option, home_of
from rapp_cli.person import Person
from rapp_nao_sim.sound.samples import RATE

LOUDNESS = 0.5  # share of full scale that the loudest moment gets, however the microphone is set


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp listen`."""
    parser.description = (
        "Records what you say until you stop, plays it to the simulated robot, and goes on while the robot asks for answers."
    )
    parser.add_argument("--device", default="default", help="ALSA device to record from; arecord -L lists them (%(default)s)")
    parser.add_argument("--file", type=Path, nargs="+", metavar="WAV", help="play these recordings in place of the microphone")
    parser.add_argument("--timeout", type=float, default=180.0, help="seconds for all of it (%(default)g)")
    add_home_option(parser)


def run(options: argparse.Namespace) -> int:
    """Listen and play until the robot listens for commands again; 1 when it did not react, or there is no microphone."""
    home = home_of(options)
    files = [_sound(path) for path in options.file or ()]
    room_of(home)
    said = _recordings(files) if files else _spoken(home, options.device)
    return asyncio.run(converse(home, said, "", options.timeout, endless=not files))


def _sound(path: Path) -> Path:
    try:
        soundfile.info(path)
    except (soundfile.LibsndfileError, OSError, TypeError) as error:  # TypeError: headerless samples, by the name .raw
        raise UsageError(f"cannot play {path}: {error}; give a sound file") from error
    return path.resolve()


async def _recordings(files: Sequence[Path]) -> AsyncIterator[Utterance]:
    for file in files:
        yield Utterance(f"({file.name})", functools.partial(Person.play, recording=file))


async def _spoken(home: Home, device: str) -> AsyncIterator[Utterance]:
    """One utterance after another, each recorded when it is asked for."""
    file = home.folder / "spoken.wav"
    try:
        while True:
            print("rapp: speak now", flush=True)
            samples = (await hear(device)).astype(np.float64)
            soundfile.write(file, samples * LOUDNESS / max(1.0, float(np.abs(samples).max())), RATE)
            yield Utterance("(your voice)", functools.partial(Person.play, recording=file))
    finally:
        file.unlink(missing_ok=True)
