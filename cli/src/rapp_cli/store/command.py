"""`./rapp store list|show|yank`: what is on offer."""

import argparse

from rapp_cli.errors import UsageError
from rapp_cli.store.place import add_store_options, noting, store_of, told
from rapp_cloud.shelf import Offer, Shelf


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp store`."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="one line per package")
    showing = actions.add_parser("show", help="all versions of a RApp, what it may do, how to ask for it, who made it")
    yanking = actions.add_parser("yank", help="take a version off offer; robots that have it keep it")
    for action in (showing, yanking):
        action.add_argument("name")
    yanking.add_argument("version")
    for action in (listing, showing, yanking):
        add_store_options(action)


@told
def run(options: argparse.Namespace) -> int:
    """Do one of them."""
    shelf = store_of(options)
    return {"list": _list, "show": _show, "yank": _yank}[options.action](shelf, options)


def _list(shelf: Shelf, _options: argparse.Namespace) -> int:
    for offer in shelf.offers():
        manifest = offer.manifest
        print(f"{manifest.name:<24} {manifest.version.text:<12} {manifest.agent:<8} {offer.publisher:<12} {manifest.description}")
    return 0


def _show(shelf: Shelf, options: argparse.Namespace) -> int:
    offers = [offer for offer in shelf.offers(yanked=True) if offer.manifest.name == options.name]
    if not offers:
        raise UsageError(f"cannot show {options.name}: it is not in the store, see ./rapp store list")
    newest = next((offer for offer in reversed(offers) if not offer.yanked), offers[-1])
    for line in _about(newest):
        print(line)
    for offer in offers:
        state = "yanked" if offer.yanked else "for " + ", ".join(offer.robots) if offer.robots else ""
        print(f"  {offer.manifest.version.text:<12} {offer.length:>9} bytes  sha256 {offer.sha256}  {state}".rstrip())
    return 0


def _about(offer: Offer) -> list[str]:
    manifest = offer.manifest
    asked = {**{f"keywords, {key}": value for key, value in manifest.keywords.items()}}
    asked |= {f"sentences, {key}": value for key, value in manifest.sentences.items()}
    needs = [*(manifest.needs.robot or ("any robot",)), f"API {manifest.needs.api}"]
    facts = {
        "about": (manifest.description,),
        "author": (manifest.author or "unknown",),
        "publisher": (offer.publisher,),
        "agent": (manifest.agent,),
        "needs": needs,
        "may use": (*manifest.permissions.core, *manifest.permissions.cloud),
        "partner": (manifest.partner,) if manifest.partner else (),
        **asked,
    }
    return [manifest.name, *(f"  {name}: {', '.join(value)}" for name, value in facts.items() if value)]


def _yank(shelf: Shelf, options: argparse.Namespace) -> int:
    with noting(options, shelf):
        shelf.yank(options.name, options.version)
    print(f"{options.name} {options.version} is off offer")
    return 0
