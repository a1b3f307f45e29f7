"""Logs of several agents in one stream."""

import io
from pathlib import Path

from rapp_cli.home.log import Log, merged


def test_lines_are_merged_by_time_and_untimed_ones_stay_behind_theirs(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_text("2026-01-01 10:00:01,000 one\nTraceback\n2026-01-01 10:00:03,000 three\n")
    (tmp_path / "b.log").write_text("READY {}\n2026-01-01 10:00:02,000 two\n")
    logs = [Log("a", tmp_path / "a.log"), Log("b", tmp_path / "b.log"), Log("c", tmp_path / "not there.log")]
    lines = [(name, text.split(",000 ")[-1]) for name, text in merged(logs)]
    assert lines == [("b", "READY {}"), ("a", "one"), ("a", "Traceback"), ("b", "two"), ("a", "three")]


def test_only_what_is_new_and_whole_is_given(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_text("one\ntw")
    log = Log("a", path)
    assert [text for _, text in merged([log])] == ["one"]
    with path.open("a") as more:
        more.write("o\nthree\n")
    assert [text for _, text in merged([log])] == ["two", "three"]
    assert list(merged([log])) == []


def test_a_log_that_is_put_aside_is_read_to_its_end_first(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_text("one\n")
    log = Log("a", path)
    assert len(list(merged([log]))) == 1
    with path.open("a") as more:
        more.write("two\n")
    path.rename(tmp_path / "a.log.1")
    path.write_text("three\n")
    assert [text for _, text in merged([log])] == ["two", "three"]


def test_of_a_long_log_the_end_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    text = io.StringIO()
    for number in range(60_000):
        text.write(f"{number}\n")
    path.write_text(text.getvalue())
    lines = [line for _, line in merged([Log("a", path)])]
    assert lines[-1] == "59999"
    assert len(lines) < 60_000
