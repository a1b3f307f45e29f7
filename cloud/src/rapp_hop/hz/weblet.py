"""What Hop's own package manager reads: `etc/weblet.info` in each package, and a publisher's list. Pure.

Both are Scheme association lists (Hop's weblet `weblets`). Hop's pattern for versions knows no SemVer pre-releases, so
those are not told to it.
"""

import re
from collections.abc import Iterable
from urllib.parse import quote

from rapp_hop.hz.manifest import Manifest

WEBLET_INFO = ("etc", "weblet.info")  # path below the package's top folder
_TITLE = 60  # characters
_PATTERN = re.compile(r"([a-z][a-z0-9_]{0,63})-((?:[0-9]{1,9}\.){0,2})\*\.hz", re.ASCII)


def weblet_info(manifest: Manifest) -> bytes:
    """Return the `etc/weblet.info` of a package."""
    return f"({' '.join(_fields(manifest))})\n".encode()


def synclist(manifests: Iterable[Manifest], download: str) -> bytes:
    """Return the list that `hophz update` fetches: the newest release of each name.

    :param download: URL of the service `download`
    """
    newest = _newest(manifests)
    lines = [f"({' '.join([_url(newest[name], download), *_fields(newest[name])])})\n" for name in sorted(newest)]
    return f"(\n{''.join(lines)})\n".encode()


def resolve(manifests: Iterable[Manifest], pattern: str) -> str:
    """Return the name of the newest package that a pattern such as `hello-*.hz` or `hello-1.2.*.hz` fits; "" for none.

    The name of a package is a pattern for itself.
    """
    packages = list(manifests)
    if any(_file(manifest) == pattern for manifest in packages):
        return pattern
    found = _PATTERN.fullmatch(pattern)
    if found is None:
        return ""
    newest = _newest(item for item in packages if item.name == found[1] and item.version.text.startswith(found[2]))
    return _file(newest[found[1]]) if newest else ""


def _newest(manifests: Iterable[Manifest]) -> dict[str, Manifest]:
    newest: dict[str, Manifest] = {}
    for manifest in manifests:
        known = newest.get(manifest.name)
        if "-" not in manifest.version.text and (known is None or known.version < manifest.version):
            newest[manifest.name] = manifest
    return newest


def _file(manifest: Manifest) -> str:
    return f"{manifest.name}-{manifest.version.text}.hz"


def _url(manifest: Manifest, download: str) -> str:
    return _field("url", f"{download}?weblet={quote(_file(manifest))}")


def _fields(manifest: Manifest) -> list[str]:
    fields = {
        "name": manifest.name,
        "version": manifest.version.text,
        "author": manifest.author or "unknown",
        "category": "other",
        "title": manifest.description[:_TITLE],
        "description": manifest.description,
    }
    return [_field(name, value) for name, value in fields.items()]


def escaped(value: str) -> str:
    """Return a text as it stands between the quotation marks of such a list."""
    return value.replace("\\", "\\\\").replace('"', '\\"')


def _field(name: str, value: str) -> str:
    return f'({name} "{escaped(value)}")'
