"""What `up` settles from options, environment and what it kept."""

import argparse
from collections.abc import Mapping

import pytest

from rapp_cli.errors import UsageError
from rapp_cli.home.place import Settings
from rapp_cli.home.up import add_options, read

KEPT = Settings("nao", None, None, None, ("--microphone", "sound", "--voice", "espeak"), {
    "roscore": 21001, "nao_sim": 21002, "rosbridge": 21003, "cloud": 21004, "mail": 21005,
})  # fmt: skip


def settle(*words: str, env: Mapping[str, str] | None = None) -> Settings:
    """What is settled when everything of KEPT is up already."""
    parser = argparse.ArgumentParser()
    add_options(parser)
    return read(parser.parse_args(words), env or {}, KEPT, running=True)


def test_the_same_wishes_are_what_is_up_already() -> None:
    assert settle() == KEPT
    assert settle("--rosbridge-port", "21003", "--name", "nao") == KEPT


@pytest.mark.parametrize(
    "words",
    [("--robot", "tcp://nao.local:9559"), ("--name", "other"), ("--cloud-port", "21009"), ("--no-world",), ("--smtp-host", "x")],
)
def test_other_wishes_need_a_down_first(words: tuple[str, ...]) -> None:
    with pytest.raises(UsageError, match="down first"):
        settle(*words)


def test_the_environment_counts_too() -> None:
    with pytest.raises(UsageError, match="down first"):
        settle(env={"RAPP_ROBOT": "tcp://nao.local:9559"})


@pytest.mark.parametrize("words", [("--mail-port", "0"), ("--mail-port", "70000"), ("--microphone", "ear"), ("--timeout", "soon")])
def test_values_that_cannot_be_are_refused(words: tuple[str, ...]) -> None:
    with pytest.raises(SystemExit) as ended:
        settle(*words)
    assert ended.value.code == 2


def test_a_port_in_the_environment_must_be_a_number() -> None:
    with pytest.raises(UsageError, match="RAPP_SMTP_PORT"):
        settle(env={"RAPP_SMTP_HOST": "smtp.example", "RAPP_SMTP_PORT": "mail"})
