"""The Mermaid drawings kept in ARCHITECTURE.md. With RAPP_DRAW=1 they are written instead of compared."""

import os
import re

from rapp_cli.paths import ROOT

ARCHITECTURE = ROOT / "ARCHITECTURE.md"


def assert_kept(name: str, drawn: str, how: str) -> None:
    """Compare a drawing with the kept one; `how` says what to run with RAPP_DRAW=1 to write it."""
    text = ARCHITECTURE.read_text()
    found = re.search(rf"(<!-- drawing: {name} -->\n```mermaid\n)(.*?)(```\n)", text, re.DOTALL)
    assert found, f"ARCHITECTURE.md has no place for a drawing of {name}"
    if os.environ.get("RAPP_DRAW"):
        ARCHITECTURE.write_text(text[: found.start(2)] + drawn + text[found.end(2) :])
        return
    assert found[2] == drawn, f"the drawing of {name} in ARCHITECTURE.md is another: run RAPP_DRAW=1 ./rapp test -- {how}"
