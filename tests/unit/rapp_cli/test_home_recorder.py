"""The recorded timeline."""

from pathlib import Path

from rapp_cli.home.recorder import Record
from rapp_cli.timeline import Entry, append, latest

LISTEN = Entry("core", "core", "s3", "entered", "listen", 10.0)
SERVE = Entry("core", "core", "s9", "entered", "serve", 11.0)


def test_the_last_entry_that_comes_again_is_not_written_twice(tmp_path: Path) -> None:
    path = tmp_path / "timeline.jsonl"
    record = Record(path)
    record.add(LISTEN)
    record.add(LISTEN)
    Record(path).add(LISTEN)  # a recorder that was started again
    assert latest(path) == [LISTEN]
    record.add(SERVE)
    record.add(LISTEN)
    assert latest(path) == [LISTEN, SERVE, LISTEN]


def test_a_large_file_is_put_aside_when_no_rapp_runs(tmp_path: Path) -> None:
    path = tmp_path / "timeline.jsonl"
    record = Record(path, largest=10)
    for entry in (LISTEN, SERVE, LISTEN):
        record.add(entry)
    assert latest(path) == [LISTEN]
    assert latest(tmp_path / "timeline.1.jsonl") == [LISTEN, SERVE]


def test_entries_that_are_cut_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "timeline.jsonl"
    assert latest(path) == []
    for entry in (LISTEN, SERVE):
        append(path, entry)
    with path.open("a") as lines:
        lines.write('{"agent": "co')
    assert latest(path) == [LISTEN, SERVE]
    assert latest(path, size=150) == [SERVE]
