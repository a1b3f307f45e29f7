"""The commands of who runs a platform: `backup`, `restore`. Each works beside a platform that serves."""

import argparse
import os
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

from rapp_cloud.backup import back_up, restore
from rapp_cloud.config import load_config


def _parser(command: str, description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(f"python -m rapp_cloud {command}", description=description)
    parser.add_argument("--data", type=Path, required=True, metavar="DIR", help="the platform's folder")
    return parser


def _database(data: Path) -> str | None:
    return load_config(data, {}, os.environ).database


def _backup(words: list[str]) -> int:
    parser = _parser("backup", "Write all that a platform keeps into one file; its secrets too.")
    parser.add_argument("file", type=Path, metavar="FILE")
    options = parser.parse_args(words)
    length = back_up(options.data, _database(options.data), options.file)
    print(f"{options.file}: {length} bytes; keep it where nobody else can read it")
    return 0


def _restore(words: list[str]) -> int:
    parser = _parser("restore", "Make a platform of a back-up, in an empty folder and an empty database.")
    parser.add_argument("file", type=Path, metavar="FILE")
    options = parser.parse_args(words)
    at = restore(options.data, _database(options.data), options.file)
    print(f"{options.data} is the platform of {datetime.fromtimestamp(at, UTC):%F %T} UTC")
    return 0


COMMANDS: Mapping[str, Callable[[list[str]], int]] = {"backup": _backup, "restore": _restore}
"""By the word after `python -m rapp_cloud`."""
