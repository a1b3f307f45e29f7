"""Entry point: reads the words after `./rapp`, runs the sub-command, gives its exit status."""

import argparse
import logging
import os
import sys
from collections.abc import Sequence

from rapp_cli.commands import COMMANDS
from rapp_cli.errors import CommandError, UsageError


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="./rapp", description="RAPP: robot applications on a spoken request.")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for command in COMMANDS:
        sub = commands.add_parser(command.name, help=command.summary, description=command.summary)
        command.add_options(sub)
        sub.set_defaults(run=command.run)
    help_command = commands.add_parser("help", help="list all commands, or show what one of them takes")
    help_command.add_argument("about", nargs="*", metavar="COMMAND", help="such as up, or cloud account")
    help_command.set_defaults(run=lambda options: _show_help(parser, options.about))
    return parser


def _show_help(parser: argparse.ArgumentParser, about: Sequence[str]) -> int:
    options = parser.parse_args([*about, "--help"])  # ends the process, unless the command reads its words itself
    return int(options.run(options))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; 0 done, 1 not done, 2 wrong words, 130 interrupted."""
    logging.basicConfig(level=logging.WARNING, format="%(name)s: %(message)s")
    options = _parser().parse_args(sys.argv[1:] if arguments is None else arguments)
    try:
        return int(options.run(options))
    except UsageError as error:
        print(f"rapp: {error}", file=sys.stderr)
        return 2
    except CommandError as error:
        print(f"rapp: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # whoever read the output has gone, such as head(1); Python would complain of it at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


if __name__ == "__main__":
    sys.exit(main())
