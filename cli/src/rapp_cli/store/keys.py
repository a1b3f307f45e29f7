"""`./rapp keys list|new|grant|rotate|root|revoke|resume`: who may sign what in a store; `own`: a publisher's own key, at home."""

import argparse
from pathlib import Path

from rapp_cli.errors import UsageError
from rapp_cli.store.own_key import add_own_options, make_own
from rapp_cli.store.place import add_store_options, audit_of, keys_of, store_of, told
from rapp_cloud.administration import refused_until_renewed
from rapp_cloud.custody import Custody
from rapp_cloud.keys import ROOTS
from rapp_cloud.witness import operator
from rapp_hop.errors import Invalid
from rapp_hop.hz.application import Application, read_application

_DONE = {"new": "may publish", "grant": "has the names", "rotate": "has a new key", "revoke": "has no key any more"}


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
    root = actions.add_parser("root", help="have several keys sign the root: one lost or stolen does not end the store")
    root.add_argument("--keys", type=int, default=3, help="how many (%(default)s); all are made anew")
    root.add_argument("--threshold", type=int, default=2, help="how many of them must sign (%(default)s)")
    revoke = actions.add_parser("revoke", help="take a publisher's key away, and all it has signed off offer")
    grant = actions.add_parser("grant", help="give names of RApps to a publisher, for good")
    resume = actions.add_parser("resume", help="have robots believe a restored store that had newer lists before")
    own = actions.add_parser(
        "own", help="on a publisher's own computer: make the key that stays there, and the file that asks for it"
    )
    for action in (new, rotate, revoke, grant, own):
        action.add_argument("name")
    grant.add_argument("rapp", nargs="+")
    for action in (new, rotate):
        action.add_argument("--public", type=Path, metavar="FILE", help="of a publisher who has made it with ./rapp keys own")
    for action in (listing, new, rotate, root, revoke, grant, resume):
        add_store_options(action)
    add_own_options(own)


@told
def run(options: argparse.Namespace) -> int:
    """Do one of them."""
    if options.action == "own":
        return make_own(options)
    custody = store_of(options).custody
    if options.action == "list":
        _list(custody)
        return 0
    with audit_of(options) as audit:
        {"root": _share_root, "resume": _resume}.get(options.action, _change)(custody, options)
        given = {name: value for name in ("rapp", "keys", "threshold") if (value := getattr(options, name, None))}
        audit.add(operator(), f"keys {options.action}", getattr(options, "name", "root"), **given)
    return 0


def _list(custody: Custody) -> None:
    for holder in custody.holders():
        until = f"{holder.expires:%F %R}" if holder.expires else "revoked"
        here = "key here" if holder.here else "key elsewhere" if holder.keys else ""
        here += f", {holder.threshold} of {len(holder.keys)} sign" if len(holder.keys) > 1 else ""
        print(f"{holder.name:<12} {until:<16} {here:<13} {' '.join(holder.keys)}  {', '.join(holder.packages)}".rstrip())


def _share_root(custody: Custody, options: argparse.Namespace) -> None:
    custody.share_root(options.keys, options.threshold)
    names = ", ".join(f"{name}.pem" for name in ROOTS[: options.keys])
    print(f"root has {options.keys} keys in {keys_of(options).folder}, {options.threshold} must sign: {names}")
    print("rapp keys: keep them apart, where no one thief and no one fire reaches as many as must sign")


def _resume(custody: Custody, _options: argparse.Namespace) -> None:
    for package in custody.resume():
        print(refused_until_renewed(package))
    print("robots believe this store; run it again if one that saw many new keys still refuses")


def _change(custody: Custody, options: argparse.Namespace) -> None:
    if options.action in ("new", "rotate"):
        (custody.add if options.action == "new" else custody.rotate)(options.name, _application(options))
    elif options.action == "grant":
        custody.grant(options.name, options.rapp)
    else:
        custody.revoke(options.name)
    print(f"{options.name} {_DONE[options.action]}")


def _application(options: argparse.Namespace) -> Application | None:
    if options.public is None:
        return None
    try:
        application = read_application(options.public.read_bytes())
    except Invalid as error:
        raise UsageError(f"{error}: {options.public} must be what ./rapp keys own has made") from None
    if application.publisher != options.name:
        raise UsageError(f"cannot take the key for {options.name}: {options.public} is {application.publisher}'s")
    return application
