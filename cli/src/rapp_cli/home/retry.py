"""`./rapp retry NAME`: a RApp that keeps failing may be started again at once, as somebody has seen to it."""

import argparse

from rapp_cli.errors import CommandError
from rapp_cli.home.place import add_home_option, home_of
from rapp_core.config import Config
from rapp_core.control.quarantine import Quarantine


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp retry`."""
    parser.description = "Lets a RApp in quarantine (./rapp status lists them) be started again at once."
    parser.add_argument("rapp", metavar="NAME")
    add_home_option(parser)


def run(options: argparse.Namespace) -> int:
    """Forget its failures; the core agent looks at each start. Raises CommandError when there are none."""
    try:
        known = Quarantine(Config(home=home_of(options).robot)).forget(options.rapp)
    except OSError as error:
        raise CommandError(f"cannot retry {options.rapp}: {error}; make room in the robot's folder") from error
    if not known:
        raise CommandError(f"cannot retry {options.rapp}: it has not failed the last time; ask the robot for it")
    print(f"{options.rapp} may be started again")
    return 0
