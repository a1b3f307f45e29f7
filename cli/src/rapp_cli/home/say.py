"""`./rapp say "…"`: a person with a synthetic voice speaks to the simulated robot."""

import argparse
import asyncio
import functools
from collections.abc import AsyncIterator, Sequence

from rapp_cli.home.conversation import Utterance, converse, room_of
from rapp_cli.home.place import add_home_option, home_of
from rapp_cli.person import Person


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp say`."""
    parser.description = "Speaks to the simulated robot and shows what it says and does until it listens again."
    parser.add_argument("text", nargs="+", metavar="TEXT", help="what to say; further texts are said when the robot asks")
    parser.add_argument("--voice", default="en-us+m3", help="espeak-ng voice of the person (%(default)s)")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds for all of it (%(default)g)")
    add_home_option(parser)


def run(options: argparse.Namespace) -> int:
    """Say all texts; 0 when the robot listens again, 1 when it did not react."""
    home = home_of(options)
    room_of(home)
    return asyncio.run(converse(home, _texts(options.text), options.voice, options.timeout))


async def _texts(texts: Sequence[str]) -> AsyncIterator[Utterance]:
    for text in texts:
        yield Utterance(text, functools.partial(Person.say, text=text))
