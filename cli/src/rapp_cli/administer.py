"""`./rapp cloud …`: back-ups, accounts, tokens, persons, audit log of a home's platform; the commands of `python -m rapp_cloud`."""

import argparse

from rapp_cli.store.place import add_store_options, data_of
from rapp_cloud.__main__ import main
from rapp_cloud.administration import COMMANDS


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp cloud`."""
    add_store_options(parser)
    parser.add_argument("action", choices=sorted(COMMANDS))
    parser.add_argument("words", nargs=argparse.REMAINDER, metavar="...", help="of that command; -h shows them")


def run(options: argparse.Namespace) -> int:
    """Do it."""
    return main([options.action, *options.words], "./rapp cloud", data_of(options))
