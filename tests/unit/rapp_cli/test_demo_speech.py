"""What the demo refuses to begin: words that nobody can speak, or that would be cut."""

import argparse
from pathlib import Path

import pytest

from rapp_cli.demo import command
from rapp_cli.demo.config import HAZARD
from rapp_cli.errors import UsageError

LONG = "please bring the medicine and some water on Monday morning, and do not forget the garden chairs and the apple tree, "


def started(folder: Path, monkeypatch: pytest.MonkeyPatch, *words: str) -> bool:
    """Whether a demo with these options starts something."""
    begun: list[Path] = []

    async def demo(config: command.DemoConfig) -> int:
        begun.append(config.folder)
        return 0

    monkeypatch.setattr(command, "_demo", demo)
    parser = argparse.ArgumentParser()
    command.add_options(parser)
    command.run(parser.parse_args(["--folder", str(folder), *words]))
    return begun == [folder]


def test_the_usual_message_fits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert started(tmp_path, monkeypatch)


@pytest.mark.parametrize("story", ["voice-mail", HAZARD])
def test_a_voice_that_is_not_there_is_refused(story: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match=r"cannot use --voice nonsense: .*espeak-ng --voices"):
        started(tmp_path, monkeypatch, story, "--voice", "nonsense")


def test_a_message_that_would_be_cut_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match=r"voice_mail has 7\.0 s; make it shorter"):
        started(tmp_path, monkeypatch, "--message", LONG)


def test_to_a_real_robot_the_user_speaks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert started(tmp_path, monkeypatch, "--robot", "tcp://nao.local:9559", "--voice", "nonsense", "--message", LONG)
