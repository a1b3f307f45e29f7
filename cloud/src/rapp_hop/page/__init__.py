"""The page on which a person tries the services; no script, style or picture from elsewhere."""

from collections.abc import Mapping
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
    return load_files(__name__, _FILES)


def load_files(
    package: str, served: Mapping[str, tuple[str, str]], more_headers: tuple[tuple[str, str], ...] = ()
) -> dict[str, WireAnswer]:
    """Return files of a package as answers whose page may use nothing from elsewhere.

    :param served: by URL path, a file's name and its media type
    """
    folder = files(package)
    headers = (("Content-Security-Policy", _POLICY), ("Referrer-Policy", "no-referrer"), *more_headers)
    return {path: WireAnswer(200, kind, folder.joinpath(name).read_bytes(), headers) for path, (name, kind) in served.items()}
