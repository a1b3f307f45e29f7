"""The page `/runs`: what robots have run, how long, and what failed. Shown to whoever has a token; nothing from elsewhere."""

from importlib.resources import files

from rapp_hop.errors import Refused
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer

PREFIX = "/runs"
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; form-action 'none'; "
    "frame-ancestors 'none'; base-uri 'none'"
)
_FILES = {
    "": ("index.html", "text/html; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
}


def runs_page() -> Mount:
    """Serve its files to everybody; the runs themselves come by the service `runs`, which asks for a token."""
    headers = (("Content-Security-Policy", _POLICY), ("Referrer-Policy", "no-referrer"), ("X-Content-Type-Options", "nosniff"))
    folder = files(__name__)
    pages = {path: WireAnswer(200, kind, folder.joinpath(name).read_bytes(), headers) for path, (name, kind) in _FILES.items()}

    async def answer(visit: Visit) -> WireAnswer:
        if visit.rest not in pages:
            raise Refused("cannot find this page: there is /runs", 404)
        return pages[visit.rest]

    return Mount(PREFIX, answer, public=True, methods=frozenset({"GET", "HEAD"}))
