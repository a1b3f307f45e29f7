"""An author's first quarter of an hour: a new RApp runs in the simulator at once, and a broken one says where it broke."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from fakes.whole_robot import processes_of

pytestmark = [pytest.mark.system, pytest.mark.timeout(200)]


def rapp(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "rapp_cli", *words]
    env = {**os.environ, "XDG_DATA_HOME": str(folder / "data")}
    process = subprocess.Popen(command, cwd=folder, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        out, err = process.communicate(timeout=150)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=30)
        raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def test_a_new_rapp_runs_at_once_and_a_broken_one_tells_where(tmp_path: Path) -> None:
    assert rapp(tmp_path, "new", "my_first").returncode == 0
    ran = rapp(tmp_path, "run", "my_first")
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr
    assert "says  “hello Maria, this is my first”" in ran.stdout
    assert ran.stdout.rstrip().endswith("rapp run: it has ended well")
    agent = tmp_path / "my_first" / "agent.py"
    agent.write_text(agent.read_text().replace("hello {person}", "hello {nobody}"))
    ran = rapp(tmp_path, "run", "my_first")
    assert ran.returncode == 1
    assert "FAILED" in ran.stdout and "nobody" in ran.stdout
    assert processes_of(tmp_path) == []


def test_a_rapp_without_english_keywords_is_asked_for_by_a_sentence_or_in_its_language(tmp_path: Path) -> None:
    assert rapp(tmp_path, "new", "my_first").returncode == 0
    package = tmp_path / "my_first" / "package.json"
    manifest = json.loads(package.read_text())
    manifest["rapp"] |= {"keywords": {"pl": ["dzień dobry"]}, "sentences": {"en": ["please greet the whole family"]}}
    package.write_text(json.dumps(manifest))
    for words in ([], ["--say", "dzień dobry"]):
        ran = rapp(tmp_path, "run", "my_first", *words)
        assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr
        assert "says  “hello Maria, this is my first”" in ran.stdout
        assert ("core->link interpret" in ran.stdout, "hears “dzień dobry”" in ran.stdout) == (not words, bool(words))


def test_so_does_one_in_javascript(tmp_path: Path) -> None:
    """Asked for by its keyword, it comes from the store, and is done; nothing of it is left."""
    assert rapp(tmp_path, "new", "my_script", "--javascript").returncode == 0
    ran = rapp(tmp_path, "run", "my_script")
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr
    story = ["hears “my script”", "link->repository GET my_script-1.0.0.hz", "says  “hello Maria, this is my script”", "destroyed"]
    assert [ran.stdout.find(each) for each in story] == sorted(ran.stdout.find(each) for each in story)
    assert all(each in ran.stdout for each in story)
    assert processes_of(tmp_path) == []
