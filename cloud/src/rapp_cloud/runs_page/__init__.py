"""The page `/runs`: what robots have run, how long, and what failed. Shown to whoever has a token; nothing from elsewhere."""

from rapp_hop.errors import Refused
from rapp_hop.mounts import Mount, Visit
from rapp_hop.page import load_files
from rapp_hop.protocol import WireAnswer

PREFIX = "/runs"
_FILES = {
    "": ("index.html", "text/html; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
}


def runs_page() -> Mount:
    """Serve its files to everybody; the runs themselves come by the service `runs`, which asks for a token."""
    pages = load_files(__name__, _FILES, (("X-Content-Type-Options", "nosniff"),))

    async def answer(visit: Visit) -> WireAnswer:
        if visit.rest not in pages:
            raise Refused("cannot find this page: there is /runs", 404)
        return pages[visit.rest]

    return Mount(PREFIX, answer, public=True, methods=frozenset({"GET", "HEAD"}))
