"""`./rapp test`: style, types, layers, then all tests, in the order of their cost.

Files of tests run side by side, but for the system tests: those speak in real time.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

from rapp_cli.paths import ROOT


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp test`."""
    parser.add_argument("--fast", action="store_true", help="leave out the system tests, which speak in real time")
    parser.add_argument("pytest", nargs="*", help="passed on to pytest, after --")


def run(options: argparse.Namespace) -> int:
    """Run every check even when an earlier one failed; 0 when all passed, else 1."""
    pytest = [sys.executable, "-m", "pytest", "--durations=25", *options.pytest]
    checks = {
        "ruff": [_tool("ruff"), "check", "."],
        "mypy": [_tool("mypy")],
        "import-linter": [_tool("lint-imports")],
        "tests": [*pytest, "-n2", "--dist=loadfile", "tests/unit", "tests/contract", "tests/integration"],
        "system tests": [*pytest, "tests/system"],
    }
    if options.fast:
        del checks["system tests"]
    failed = [name for name, words in checks.items() if not _passes(name, words)]
    if failed:
        print(f"rapp test: failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


def _tool(name: str) -> str:
    return str(Path(sys.executable).with_name(name))


def _passes(name: str, words: list[str]) -> bool:
    began = time.monotonic()
    print(f"rapp test: {name}", flush=True)
    result = subprocess.run(words, cwd=ROOT, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}, check=False)
    print(f"rapp test: {name}: exit status {result.returncode} after {time.monotonic() - began:.0f} s", flush=True)
    return result.returncode == 0
