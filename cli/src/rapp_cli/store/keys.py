"""`./rapp keys list|new|rotate|revoke`: who may sign for what in a store."""

import argparse

from rapp_cli.store.place import add_store_options, store_of, told


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp keys`."""
    parser.description = (
        "Who may sign for what in a store. Its keys are encrypted; the passphrase is in the file that "
        "RAPP_CLOUD_PASSPHRASE_FILE names, in RAPP_CLOUD_PASSPHRASE, or beside them."
    )
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="show roles and publishers, their keys, and until when their word is good")
    new = actions.add_parser("new", help="make a publisher, or give one whose key was revoked another")
    rotate = actions.add_parser("rotate", help="give a role (root, targets, snapshot, timestamp) or publisher a new key")
    revoke = actions.add_parser("revoke", help="take a publisher's key away, and all it has signed off offer")
    for action in (new, rotate, revoke):
        action.add_argument("name")
    for action in (listing, new, rotate, revoke):
        add_store_options(action)


@told
def run(options: argparse.Namespace) -> int:
    """Do one of them."""
    custody = store_of(options).custody
    if options.action == "list":
        for holder in custody.holders():
            until = f"{holder.expires:%F %R}" if holder.expires else "revoked"
            here = "key here" if holder.here else "key elsewhere" if holder.keys else ""
            print(f"{holder.name:<12} {until:<16} {here:<13} {' '.join(holder.keys)}  {', '.join(holder.packages)}".rstrip())
        return 0
    {"new": custody.add, "rotate": custody.rotate, "revoke": custody.revoke}[options.action](options.name)
    done = {"new": "may publish", "rotate": "has a new key", "revoke": "has no key any more"}[options.action]
    print(f"{options.name} {done}")
    return 0
