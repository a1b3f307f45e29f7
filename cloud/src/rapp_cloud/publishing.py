"""What a RApp must be to stand beside the others in a store: newer than before, and asked for in words of its own. Pure."""

import re
import unicodedata
from collections.abc import Iterable, Iterator

from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.manifest import STOP, Manifest

_NO_WORD = re.compile(r"[^\w]+|_")


def check_publication(manifest: Manifest, offered: Iterable[Manifest]) -> None:
    """Check a package against those on offer.

    :raises Invalid: when nobody could ask for it
    :raises Refused: when a newer version is there, its cloud agent is not, or its words are another's
    """
    others = list(offered)
    _check_version(manifest, others)
    if manifest.agent != "dynamic":
        return
    if not any(manifest.keywords.values()) and not any(manifest.sentences.values()):
        raise Invalid(f"cannot publish {manifest.name}: nobody could ask for it, give it a keyword or a sentence")
    _check_partner(manifest, others)
    clashes = collisions(manifest, others)
    if clashes:
        raise Refused(f"cannot publish {manifest.name}: {'; '.join(clashes)}; choose other words")


def collisions(manifest: Manifest, offered: Iterable[Manifest]) -> list[str]:
    """Return which words of a RApp are the robot's own or of another one's newest version, compared as they are spoken."""
    newest: dict[str, Manifest] = {}
    for other in offered:
        if other.name != manifest.name and (other.name not in newest or newest[other.name].version < other.version):
            newest[other.name] = other
    taken = {spoken: f"for {other.name}" for other in newest.values() for spoken in _spoken(other)}
    taken |= {(language, _plain(word)): "to stop the robot" for language, word in STOP.items()}
    return [
        f"{text!r} ({language}) is what one says {taken[language, plain]}"
        for (language, plain), text in _spoken(manifest).items()
        if (language, plain) in taken
    ]


def _check_version(manifest: Manifest, others: list[Manifest]) -> None:
    versions = [other.version for other in others if other.name == manifest.name]
    newest = max(versions, key=lambda version: version.key, default=None)
    if newest is not None and manifest.version.key <= newest.key:
        raise Refused(f"cannot publish {manifest.name} {manifest.version}: {newest} is on offer, raise its version")


def _check_partner(manifest: Manifest, others: list[Manifest]) -> None:
    if manifest.partner is None:
        return
    wanted = (manifest.partner, manifest.version.text, "cloud")
    if wanted not in {(other.name, other.version.text, other.agent) for other in others}:
        raise Refused(f"cannot publish {manifest.name}: publish its cloud agent {manifest.partner} {manifest.version} first")


def _spoken(manifest: Manifest) -> dict[tuple[str, str], str]:
    """All that one can say for a RApp: by language and plain words, as it is written."""
    return {(language, _plain(text)): text for language, text in _phrases(manifest)}


def _phrases(manifest: Manifest) -> Iterator[tuple[str, str]]:
    for texts in (manifest.keywords, manifest.sentences):
        for language, spoken in texts.items():
            yield from ((language, text) for text in spoken)


def _plain(text: str) -> str:
    return _NO_WORD.sub(" ", unicodedata.normalize("NFKC", text).casefold()).strip()
