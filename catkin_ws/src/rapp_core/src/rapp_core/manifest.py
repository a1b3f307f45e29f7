"""What the core agent reads of an installed RApp's package.json (DESIGN section 3.4)."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_core.errors import Invalid

PYTHON, JAVASCRIPT = RUNTIMES = ("python3", "javascript")


@dataclass(frozen=True)
class Manifest:
    """A RApp's name, version, the words that ask for it, what it runs and what it may use."""

    name: str
    version: str
    keywords: dict[str, tuple[str, ...]]  # by language
    entry: str  # path of the program within the package
    parameters: dict[str, Any]
    core: frozenset[str]  # core services it may call
    cloud: frozenset[str]  # calls that leave the robot it may make
    runtime: str = PYTHON  # what runs the entry: PYTHON or JAVASCRIPT
    partner: str | None = None  # the package of its cloud agent, in a four-agent RApp


def read_manifest(package: Path) -> Manifest:
    """The manifest of the package in a folder. Raises Invalid."""
    try:
        whole = json.loads((package / "package.json").read_text())
        rapp = whole["rapp"]
        manifest = Manifest(
            name=str(whole["name"]),
            version=str(whole["version"]),
            keywords={str(language): tuple(map(str, words)) for language, words in rapp["keywords"].items()},
            entry=str(rapp["entry"]),
            parameters=dict(rapp.get("parameters", {})),
            core=frozenset(map(str, rapp["permissions"]["core"])),
            cloud=frozenset(map(str, rapp["permissions"]["cloud"])),
            runtime=str(rapp.get("runtime", PYTHON)),
            partner=None if rapp.get("partner") is None else str(rapp["partner"]),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Invalid(f"cannot use {package}: its package.json is broken ({error!r}); install it anew") from error
    if not (package / manifest.entry).resolve().is_relative_to(package.resolve()):
        raise Invalid(f"cannot use {package}: its entry {manifest.entry!r} lies outside of it")
    if manifest.runtime not in RUNTIMES:
        raise Invalid(f"cannot use {package}: it is written for {manifest.runtime!r}, known are {', '.join(RUNTIMES)}")
    return manifest
