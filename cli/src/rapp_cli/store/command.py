"""`./rapp store list|show|yank|renew`: what is on offer, here or in a store elsewhere."""

import argparse

from rapp_cli.errors import UsageError
from rapp_cli.store.far import about, list_far, renew_far, show_far, yank_far
from rapp_cli.store.place import add_store_options, noting, store_of, told
from rapp_cli.store.remote import add_cloud_option
from rapp_cloud.shelf import Shelf


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp store`."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="one line per package")
    showing = actions.add_parser("show", help="all versions of a RApp, what it may do, how to ask for it, who made it")
    yanking = actions.add_parser("yank", help="take a version off offer; robots that have it keep it")
    renewing = actions.add_parser("renew", help="sign a publisher's list in a store elsewhere for another year")
    for action in (showing, yanking):
        action.add_argument("name")
    yanking.add_argument("version")
    for action in (yanking, renewing):
        action.add_argument("--publisher", metavar="NAME", help="who signs, in a store elsewhere (whose key is here)")
    for action in (listing, showing, yanking, renewing):
        add_store_options(action)
        add_cloud_option(action)


@told
def run(options: argparse.Namespace) -> int:
    """Do one of them."""
    if options.cloud:
        return {"list": list_far, "show": show_far, "yank": yank_far, "renew": renew_far}[options.action](options)
    if options.action == "renew":
        raise UsageError("cannot renew lists here: the platform does so by itself; name one elsewhere with --cloud")
    shelf = store_of(options)
    return {"list": _list, "show": _show, "yank": _yank}[options.action](shelf, options)


def _list(shelf: Shelf, _options: argparse.Namespace) -> int:
    for offer in shelf.offers():
        manifest = offer.manifest
        says = manifest.description + (f"  expired, {offer.publisher} must sign again" if offer.expired else "")
        print(f"{manifest.name:<24} {manifest.version.text:<12} {manifest.agent:<8} {offer.publisher:<12} {says}")
    return 0


def _show(shelf: Shelf, options: argparse.Namespace) -> int:
    offers = [offer for offer in shelf.offers(yanked=True) if offer.manifest.name == options.name]
    if not offers:
        raise UsageError(f"cannot show {options.name}: it is not in the store, see ./rapp store list")
    newest = next((offer for offer in reversed(offers) if not offer.yanked), offers[-1])
    for line in about(newest.manifest, newest.publisher):
        print(line)
    for offer in offers:
        state = "yanked" if offer.yanked else "for " + ", ".join(offer.robots) if offer.robots else ""
        print(f"  {offer.manifest.version.text:<12} {offer.length:>9} bytes  sha256 {offer.sha256}  {state}".rstrip())
    return 0


def _yank(shelf: Shelf, options: argparse.Namespace) -> int:
    with noting(options, shelf):
        shelf.yank(options.name, options.version)
    print(f"{options.name} {options.version} is off offer")
    return 0
