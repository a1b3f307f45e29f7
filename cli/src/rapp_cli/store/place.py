"""Which store a command is about, and its errors in the words of the terminal."""

import argparse
import functools
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rapp_cli.errors import CommandError, UsageError
from rapp_cli.home.place import add_home_option, home_of
from rapp_cloud.app import open_shelf
from rapp_cloud.audit import Audit
from rapp_cloud.config import load_config
from rapp_cloud.keys import KeyRing, passphrase_from
from rapp_cloud.memory import open_memory
from rapp_cloud.shelf import Shelf
from rapp_cloud.witness import noting_offers
from rapp_hop.errors import HopError, Invalid

Run = Callable[[argparse.Namespace], int]


def add_store_options(parser: argparse.ArgumentParser) -> None:
    """The options that name a store."""
    add_home_option(parser)
    parser.add_argument("--data", type=Path, metavar="DIR", help="a platform's data folder, in place of a home's")


def store_of(options: argparse.Namespace) -> Shelf:
    """Open the store that the options name. Raises UsageError when there is none."""
    data = data_of(options)
    shelf = open_shelf(data, passphrase_from(os.environ))
    if not shelf.root_file.exists():
        raise UsageError(f"cannot find a store in {data}: ./rapp up makes one, or name its folder with --data")
    return shelf


@contextmanager
def noting(options: argparse.Namespace, shelf: Shelf) -> Iterator[None]:
    """Have the platform's audit log note what the block changes of its offers."""
    data = data_of(options)
    with noting_offers(data, shelf, load_config(data, {}, os.environ).database):
        yield


@contextmanager
def audit_of(options: argparse.Namespace) -> Iterator[Audit]:
    """The platform's audit log, open before the block changes anything."""
    data = data_of(options)
    with open_memory(data, load_config(data, {}, os.environ).database) as memory:
        yield memory.audit


def keys_of(options: argparse.Namespace) -> KeyRing:
    """The keys of the store that the options name."""
    return KeyRing(data_of(options) / "keys", passphrase_from(os.environ))


def told(run: Run) -> Run:
    """Turn what goes wrong below into errors of the command: wrong input into exit status 2, the rest into 1."""

    @functools.wraps(run)
    def running(options: argparse.Namespace) -> int:
        try:
            return run(options)
        except Invalid as error:
            raise UsageError(str(error)) from error
        except HopError as error:
            raise CommandError(str(error)) from error
        except BrokenPipeError:
            raise  # whoever read the output has gone
        except OSError as error:
            raise CommandError(f"cannot use {error.filename}: {error.strerror}") from error

    return running


def data_of(options: argparse.Namespace) -> Path:
    """The data folder of the platform that the options name."""
    data: Path | None = options.data
    return (data if data is not None else home_of(options).cloud).expanduser().resolve()
