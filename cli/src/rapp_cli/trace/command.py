"""`./rapp trace`: finds the last run and draws it."""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import platformdirs

from rapp_cli.errors import CommandError, UsageError
from rapp_cli.timeline import Entry
from rapp_cli.trace.figures import FIGURES, figure
from rapp_cli.trace.mermaid import to_mermaid
from rapp_cli.trace.messages import Item, entries, last_run
from rapp_cli.trace.svg import to_svg
from rapp_cloud.files import write_whole

RECORD, BEFORE = "timeline.jsonl", "timeline.1.jsonl"  # the second was put aside when it had grown large
SUFFIXES = {"svg": ".svg", "mermaid": ".mmd"}
TERMINAL = Path("-")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp trace`."""
    parser.description = (
        "Draws the last run, from the command until the robot listens again, as a UML sequence diagram of the messages that "
        "were sent. Without --output it writes trace.svg and trace.mmd into the folder."
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "folder", nargs="?", type=Path, help="of a demo, or the home of ./rapp up (default: where something ran last)"
    )
    where.add_argument("--home", type=Path, metavar="DIR", help="the same, as for the commands beside this one")
    numbers = ", ".join(map(str, FIGURES))
    parser.add_argument("--figure", type=int, choices=FIGURES, metavar="N", help=f"only what is figure N of the paper: {numbers}")
    parser.add_argument("--format", choices=SUFFIXES, help="only this one")
    parser.add_argument("--output", type=Path, metavar="FILE", help="write there; - is the terminal")


def run(options: argparse.Namespace) -> int:
    """Draw; gives 0. Raises UsageError, CommandError."""
    folder = (options.folder or options.home or newest(_data())).expanduser().resolve()
    items = last_run(read(folder))
    title = f"RAPP, {time.strftime('%Y-%m-%d %H:%M', time.localtime(items[0].time))}"
    if options.figure is not None:
        items = figure(items, options.figure)
        title = f"Figure {options.figure}: {FIGURES[options.figure].title}"
    stem = "trace" if options.figure is None else f"figure-{options.figure}"
    for kind, path in _outputs(options, folder / stem).items():
        _write(path, _drawn(kind, items, title))
    return 0


def newest(data: Path) -> Path:
    """The folder, of demos and home, whose record was written last. Raises CommandError when there is none."""
    records = [path for path in (*data.glob(f"demo/*/{RECORD}"), data / "home" / RECORD) if path.is_file()]
    if not records:
        raise CommandError(f"cannot draw: nothing has run in {data} yet; run ./rapp demo, or give a folder")
    return max(records, key=lambda path: path.stat().st_mtime).parent


def read(folder: Path) -> list[Entry]:
    """The record of a folder. Raises CommandError."""
    paths = [path for path in (folder / BEFORE, folder / RECORD) if path.is_file()]
    if not paths:
        raise CommandError(f"cannot find {folder / RECORD}: give the folder of a demo or of ./rapp up")
    try:
        return [entry for path in paths for entry in entries(path.read_text().splitlines(), str(path))]
    except (OSError, UnicodeDecodeError) as error:
        raise CommandError(f"cannot read the record in {folder}: {error}; give another folder") from error


def _data() -> Path:
    return Path(platformdirs.user_data_dir("rapp"))


def _outputs(options: argparse.Namespace, stem: Path) -> dict[str, Path]:
    if options.output is None:
        return {kind: stem.with_suffix(SUFFIXES[kind]) for kind in ([options.format] if options.format else SUFFIXES)}
    kinds = [options.format] if options.format else [k for k, suffix in SUFFIXES.items() if suffix == options.output.suffix]
    if not kinds:
        raise UsageError(f"cannot tell the format of {options.output}: give --format svg or --format mermaid")
    return {kinds[0]: options.output}


def _drawn(kind: str, items: Sequence[Item], title: str) -> str:
    return to_svg(items, title) if kind == "svg" else to_mermaid(items)


def _write(path: Path, text: str) -> None:
    if path == TERMINAL:
        sys.stdout.write(text)
        return
    try:
        write_whole(path, text.encode())
    except OSError as error:
        raise CommandError(f"cannot write {path}: {error.strerror}; give another --output") from error
    print(path)
