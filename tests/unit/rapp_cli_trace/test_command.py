import json
import os
from dataclasses import asdict
from pathlib import Path
from xml.etree import ElementTree

import platformdirs
import pytest

from rapp_cli.__main__ import main
from rapp_cli.timeline import Entry


def write(folder: Path, said: str, age: float = 0.0, name: str = "timeline.jsonl") -> Path:
    """The record of a run in which the robot said one text."""
    found = [
        Entry("core", "core", "s3", "left", "", 1.0),
        Entry("core", "core", "s9", "message", "dynamic->core rapp_say", 2.0),
        Entry("core", "core", "s9", "said", said, 2.5),
        Entry("core", "core", "s9", "message", "core->dynamic reply rapp_say", 3.0),
    ]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text("".join(json.dumps(asdict(entry)) + "\n" for entry in found))
    os.utime(path, (1e9 - age, 1e9 - age))
    return folder


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(platformdirs, "user_data_dir", lambda _name: str(tmp_path / "data"))
    return tmp_path / "data"


def test_both_drawings_lie_beside_the_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, "hello")
    assert main(["trace", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines() == [str(tmp_path / "trace.svg"), str(tmp_path / "trace.mmd")]
    assert ElementTree.parse(tmp_path / "trace.svg").getroot().tag.endswith("svg")
    assert "a_core-)person: “hello”" in (tmp_path / "trace.mmd").read_text()


def test_a_home_is_named_as_for_the_other_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, "hello")
    assert main(["trace", "--home", str(tmp_path), "--format", "svg"]) == 0
    assert capsys.readouterr().out.splitlines() == [str(tmp_path / "trace.svg")]


@pytest.mark.parametrize("newer", ["demo/1", "demo/2", "home"])
def test_without_a_folder_the_last_run_is_drawn(data: Path, newer: str, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("demo/1", "demo/2", "home"):
        write(data / name, f"this is {name}", 0.0 if name == newer else 60.0)
    assert main(["trace", "--format", "mermaid", "--output", "-"]) == 0
    assert f"this is {newer}" in capsys.readouterr().out


def test_a_figure_is_written_under_its_own_name(tmp_path: Path) -> None:
    write(tmp_path, "hello")
    assert main(["trace", str(tmp_path), "--figure", "10", "--format", "svg"]) == 0
    assert "Figure 10" in (tmp_path / "figure-10.svg").read_text()
    assert not (tmp_path / "figure-10.mmd").exists()


@pytest.mark.parametrize(("name", "begin"), [("a.svg", "<svg"), ("a.mmd", "sequenceDiagram")])
def test_the_name_of_the_output_tells_the_format(tmp_path: Path, name: str, begin: str) -> None:
    write(tmp_path, "hello")
    assert main(["trace", str(tmp_path), "--output", str(tmp_path / name)]) == 0
    assert (tmp_path / name).read_text().startswith(begin)


def test_a_record_that_was_put_aside_is_read_too(tmp_path: Path) -> None:
    write(tmp_path, "before", name="timeline.1.jsonl")
    (tmp_path / "timeline.jsonl").write_text("")
    assert main(["trace", str(tmp_path)]) == 0
    assert "before" in (tmp_path / "trace.mmd").read_text()


def test_nothing_has_run_yet(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trace"]) == 1
    assert capsys.readouterr().err == f"rapp: cannot draw: nothing has run in {data} yet; run ./rapp demo, or give a folder\n"


def test_a_folder_without_a_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trace", str(tmp_path)]) == 1
    assert "give the folder of a demo or of ./rapp up" in capsys.readouterr().err


@pytest.mark.parametrize("content", [b"{\n{}\n", b"\xff\xfe\n"])
def test_a_broken_record(tmp_path: Path, content: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "timeline.jsonl").write_bytes(content)
    assert main(["trace", str(tmp_path)]) == 1
    assert "rapp: cannot read" in capsys.readouterr().err


def test_a_format_that_cannot_be_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, "hello")
    assert main(["trace", str(tmp_path), "--output", "a.png"]) == 2
    assert "--format" in capsys.readouterr().err


def test_an_output_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, "hello")
    assert main(["trace", str(tmp_path), "--output", str(tmp_path / "none" / "a.svg")]) == 1
    assert "give another --output" in capsys.readouterr().err
