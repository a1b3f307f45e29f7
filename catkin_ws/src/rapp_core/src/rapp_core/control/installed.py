"""The RApps on this robot's disk, as the link installs them: $RAPP_HOME/rapps/<name>/current/."""

import logging
from dataclasses import dataclass
from pathlib import Path

from rapp_core.errors import Invalid
from rapp_core.manifest import read_manifest

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Known:
    """A RApp the robot can run: installed (`path` is its package) or offered by the platform (`path` is None)."""

    name: str
    version: str
    keywords: tuple[str, ...]
    path: Path | None


def installed(home: Path, language: str) -> dict[str, Known]:
    """All installed RApps whose package.json can be read, by name; a broken one is the link's to repair."""
    found = {}
    for path in sorted((home / "rapps").glob("*/current")):
        try:
            manifest = read_manifest(path.resolve())
        except Invalid as error:
            _log.warning("%s", error)
            continue
        words = manifest.keywords.get(language, ())
        found[manifest.name] = Known(manifest.name, manifest.version, words, path.resolve())
    return found
