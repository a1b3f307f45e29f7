"""`./rapp help`."""

import pytest

from rapp_cli.__main__ import main
from rapp_cli.commands import COMMANDS


@pytest.mark.parametrize(
    ("about", "shown"), [((), [command.name for command in COMMANDS]), (("up",), ["--cloud"]), (("cloud", "account"), ["--role"])]
)
def test_help_lists_the_commands_or_shows_what_one_takes(
    about: tuple[str, ...], shown: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["help", *about])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert all(word in said for word in shown)


def test_help_about_what_is_no_command_names_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["help", "fly"])
    assert ended.value.code == 2
    assert "'up'" in capsys.readouterr().err


@pytest.mark.parametrize("words", [("person",), ("person", "add"), ("tokens",)])
def test_the_platform_s_commands_are_shown_as_they_are_typed(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["cloud", *words, "-h"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert said.startswith(f"usage: ./rapp cloud {' '.join(words)} [-h]")
    assert "--data DIR" not in said.replace("[--data DIR]", "").partition("\n\n")[0]
