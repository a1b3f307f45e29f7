"""The page on which a person tries the services; no script, style or picture from elsewhere."""

from importlib.resources import files

from rapp_hop.protocol import WireAnswer

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; form-action 'none'; "
    "frame-ancestors 'none'; base-uri 'none'"
)
_FILES = {
    "/hop/": ("index.html", "text/html; charset=utf-8"),
    "/hop/-/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/hop/-/page.css": ("page.css", "text/css; charset=utf-8"),
}


def load_pages() -> dict[str, WireAnswer]:
    """Return the files of the page by URL path."""
    folder = files(__name__)
    headers = (("Content-Security-Policy", _POLICY), ("Referrer-Policy", "no-referrer"))
    return {path: WireAnswer(200, kind, folder.joinpath(name).read_bytes(), headers) for path, (name, kind) in _FILES.items()}
