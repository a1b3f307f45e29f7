"""`./rapp runs`: what the robots of a platform have run, how long, and what failed."""

import argparse
import json
import os
from datetime import datetime
from typing import Any

from rapp_cli.store.place import add_store_options, data_of, told
from rapp_cloud.config import load_config
from rapp_cloud.memory import open_memory

LATEST = 1e11  # seconds since 1970 that a date can have


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp runs`."""
    parser.add_argument("which", nargs="?", metavar="RUN", help="show this one with its states")
    parser.add_argument("--robot", metavar="NAME", help="of this robot only")
    parser.add_argument("--last", type=int, default=20, metavar="N", help="so many (%(default)s)")
    parser.add_argument("--json", action="store_true", help="as JSON, one run a line")
    add_store_options(parser)


@told
def run(options: argparse.Namespace) -> int:
    """List them, the newest last; 1 when there is none."""
    data = data_of(options)
    with open_memory(data, load_config(data, {}, os.environ).database) as memory:
        found = memory.reports.of(options.robot, options.last if options.which is None else 100_000)
    if options.which is not None:
        found = [one for one in found if one.get("run") == options.which]
    for one in reversed(found):
        print(json.dumps(one) if options.json else _line(one))
        if options.which is not None and not options.json:
            print("\n".join(_states(one)))
    return 0 if found else 1


def _line(run: dict[str, Any]) -> str:
    when = datetime.fromtimestamp(_number(run.get("began")) or run["received"]).astimezone()
    errors = "; ".join(dict.fromkeys(_text(error, "detail") for error in _list(run, "errors")))  # each state may tell of the same
    what = f"{_text(run, 'rapp')} {_text(run, 'version')}"
    took = f"{_number(run.get('seconds')):7.1f} s  {_text(run, 'run')}"
    return f"{when:%F %T} {run['robot']:<12} {what:<28} {_text(run, 'outcome'):<7} {took}  {errors}".rstrip()


def _states(run: dict[str, Any]) -> list[str]:
    found = []
    for one in _list(run, "states"):
        at, took = _number(one.get("at")), _number(one.get("seconds"))
        found.append(f"  {at:8.2f} s  {_text(one, 'agent'):<8} {_text(one, 'state'):<16} for {took:.2f} s")
    return found


def _list(run: dict[str, Any], name: str) -> list[dict[str, Any]]:
    value = run.get(name)
    return [one for one in value if isinstance(one, dict)] if isinstance(value, list) else []


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) and abs(value) < LATEST else 0.0


def _text(values: dict[str, Any], name: str) -> str:
    """A robot's words; nothing of them may move the terminal's cursor."""
    return "".join(letter if letter.isprintable() else "?" for letter in str(values.get(name, "")))
