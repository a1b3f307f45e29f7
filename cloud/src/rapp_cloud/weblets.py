"""The store as Hop's own package manager sees it: `/hop/weblets/{synclist,download,resolve}` (Hop's weblet `weblets`).

`hophz` knows no signatures: what a robot installs comes through `/tuf/`, verified.
"""

import asyncio
from urllib.parse import parse_qs

from rapp_cloud.shelf import Offer, Shelf
from rapp_cloud.views import Once
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.manifest import Manifest
from rapp_hop.hz.weblet import escaped, resolve, synclist
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer
from rapp_hop.results import ANY_TYPE

PREFIX = "/hop/weblets/"
_TEXT = "text/plain; charset=UTF-8"
_MAX_PATTERN = 200  # characters
_HERE = "\0"  # in the list that is kept, for the URL by which the caller reaches us: no text of a package has it


def weblets(shelf: Shelf, scheme: str) -> Mount:
    """Serve the list of packages, the packages, and the search for one; to be read only, by everybody.

    Packages of cloud agents are no weblets of a robot, and not in the list. Nor are those for some robots only, or whose
    publisher's list has run out.

    :param scheme: http or https, as callers reach this platform
    """

    listed = Once(shelf.manifests, lambda _: _listed(shelf))
    whole = Once(shelf.manifests, lambda _: synclist(listed(), _HERE))

    async def answer(visit: Visit) -> WireAnswer:
        if visit.rest == "synclist":
            here = escaped(f"{scheme}://{visit.request.headers.get('host', '')}{PREFIX}download")
            return WireAnswer(200, _TEXT, (await asyncio.to_thread(whole)).replace(_HERE.encode(), here.encode()))
        if visit.rest == "resolve":
            found = resolve(await asyncio.to_thread(listed), _asked(visit))
            return WireAnswer(200, _TEXT, found.encode())
        if visit.rest == "download":
            file = await asyncio.to_thread(shelf.file_of, _asked(visit))
            if file is None:
                raise Refused("cannot find this package: see /hop/weblets/synclist", 404)
            return WireAnswer(200, ANY_TYPE, file)
        raise Refused("cannot find this page: there are synclist, download and resolve", 404)

    return Mount(PREFIX, answer, public=True, methods=frozenset({"GET", "HEAD"}))


def _listed(shelf: Shelf) -> list[Manifest]:
    return [offer.manifest for offer in shelf.offers() if _is_listed(offer)]


def _is_listed(offer: Offer) -> bool:
    return offer.manifest.agent == "dynamic" and not offer.robots and not offer.expired


def _asked(visit: Visit) -> str:
    try:
        (pattern,) = parse_qs(visit.request.query, max_num_fields=8)["weblet"]
    except (KeyError, ValueError):
        raise Invalid("cannot tell which package: give ?weblet=NAME-VERSION.hz") from None
    if len(pattern) > _MAX_PATTERN:
        raise Invalid(f"cannot use a name of more than {_MAX_PATTERN} characters")
    return pattern
