"""The RApps on this robot's disk, as the link installs them: $RAPP_HOME/rapps/<name>/current/."""

import json
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Known:
    """A RApp the robot can run: installed (`path` is its package) or offered by the platform (`path` is None)."""

    name: str
    keywords: tuple[str, ...]
    path: Path | None


def installed(home: Path, language: str) -> dict[str, Known]:
    """All installed RApps whose package.json can be read, by name."""
    found = {}
    for path in sorted((home / "rapps").glob("*/current")):
        try:
            manifest = json.loads((path / "package.json").read_text())
            keywords = tuple(str(k) for k in manifest["rapp"]["keywords"].get(language, ()))
            found[str(manifest["name"])] = Known(str(manifest["name"]), keywords, path.resolve())
        except (OSError, ValueError, KeyError, AttributeError, TypeError):
            continue  # a half-written package is the link's to repair; the others still run
    return found
