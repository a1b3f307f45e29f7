"""A node in a process of its own, which a test tells what to do by lines on its standard input."""

import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager


@contextmanager
def told_node(env: Mapping[str, str], program: str, *words: str) -> Iterator["subprocess.Popen[str]"]:
    """Runs a Python program with words; ended with the block."""
    command, pipe = [sys.executable, "-c", program, *words], subprocess.PIPE
    process = subprocess.Popen(command, env=env, stdin=pipe, stdout=pipe, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()
