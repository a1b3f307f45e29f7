"""The store's page for people, at `/store`: RApps with versions, permissions, how to ask for them and who made them.

Made whole on the server; no script, and the policy it is sent with allows none. All texts of packages are escaped (H20).
"""

import asyncio
import base64
import hashlib
from collections.abc import Iterable
from html import escape

from rapp_cloud.shelf import Offer, Shelf
from rapp_cloud.views import Once
from rapp_hop.errors import Refused
from rapp_hop.hz.manifest import Manifest
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer

PREFIX = "/store"
_STYLE = (
    "body{font:16px/1.5 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1d2433}"
    "article{border-top:1px solid #c9d0dc;padding:.5rem 0 1rem}h2{margin:.5rem 0 0}"
    "dl{display:grid;grid-template-columns:9rem 1fr;gap:.2rem 1rem}dt{color:#5a6474}dd{margin:0}"
    "code{background:#eef1f6;padding:0 .3rem}"
)
_STYLE_HASH = base64.b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()
_POLICY = f"default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; style-src 'sha256-{_STYLE_HASH}'"


def store_page(shelf: Shelf) -> Mount:
    """Serve the page, to everybody. Packages for some robots only are not on it."""

    page = Once(shelf.manifests, lambda _: render(shelf.offers()).encode())

    async def answer(visit: Visit) -> WireAnswer:
        if visit.rest not in ("", "/"):
            raise Refused("cannot find this page: there is /store", 404)
        text = await asyncio.to_thread(page)
        return WireAnswer(200, "text/html; charset=UTF-8", text, (("Content-Security-Policy", _POLICY),))

    return Mount(PREFIX, answer, public=True, methods=frozenset({"GET", "HEAD"}))


def render(offers: Iterable[Offer]) -> str:
    """Return the page for these packages."""
    versions: dict[str, list[Offer]] = {}
    for offer in sorted(offers, key=lambda offer: offer.manifest.version.key):
        if offer.manifest.agent == "dynamic" and not offer.robots:
            versions.setdefault(offer.manifest.name, []).append(offer)
    articles = "".join(_article(versions[name]) for name in sorted(versions)) or "<p>The store is empty.</p>"
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1"><title>RApp store</title>'
        f"<style>{_STYLE}</style></head><body><h1>RApp store</h1>{articles}</body></html>\n"
    )


def _article(offers: list[Offer]) -> str:
    newest = max(offers, key=lambda offer: ("-" not in offer.manifest.version.text, offer.manifest.version.key))
    manifest = newest.manifest
    rows = {
        "Say": _asked(manifest),
        "Runs on": escape(", ".join(manifest.needs.robot) or "any robot") + f" with API {escape(manifest.needs.api)}",
        "May use": _codes((*manifest.permissions.core, *manifest.permissions.cloud)) or "nothing",
        "Cloud agent": _codes([manifest.partner]) if manifest.partner else "",
        "Made by": escape(manifest.author or "unknown"),
        "Signed by": escape(newest.publisher) + (": the list has run out, robots refuse it" if newest.expired else ""),
        "Versions": _codes([offer.manifest.version.text for offer in reversed(offers)]),
    }
    listed = "".join(f"<dt>{name}</dt><dd>{value}</dd>" for name, value in rows.items() if value)
    title = f"<h2>{escape(manifest.name)} {escape(manifest.version.text)}</h2>"
    return f'<article id="{escape(manifest.name)}">{title}<p>{escape(manifest.description)}</p><dl>{listed}</dl></article>'


def _asked(manifest: Manifest) -> str:
    said = [
        f'<q lang="{escape(language)}">{escape(text)}</q>'
        for texts in (manifest.keywords, manifest.sentences)
        for language, spoken in texts.items()
        for text in spoken
    ]
    return ", ".join(said)


def _codes(words: Iterable[str]) -> str:
    return " ".join(f"<code>{escape(word)}</code>" for word in words)
