"""`./rapp bench SUBJECT`: runs one program of tests/benchmarks, which prints its table."""

import argparse
import os
import subprocess
import sys

from rapp_cli.paths import BENCHMARKS, ROOT

SUBJECTS = {
    "activation": "activation.py",
    "speech": "speech.py",
    "interpret": "interpret.py",
    "rosbridge": "rosbridge.py",
    "hop": "hop.py",
    "robot": "robot.py",
    "store": "store.py",
}
"""Subject to program."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp bench`."""
    parser.add_argument("subject", choices=sorted(SUBJECTS))
    parser.add_argument("options", nargs=argparse.REMAINDER, help="passed on to the program")


def run(options: argparse.Namespace) -> int:
    """Run the benchmark in the foreground; its exit status."""
    words = [sys.executable, str(BENCHMARKS / SUBJECTS[options.subject]), *options.options]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(BENCHMARKS.parent), os.environ.get("PYTHONPATH", "")])}
    return subprocess.run(words, cwd=ROOT, env=env, check=False).returncode
