"""What the demo reads from options and environment."""

import argparse
from pathlib import Path

import pytest

from rapp_cli.cloud import CONTACTS, contacts_with
from rapp_cli.demo.config import HAZARD, KEYWORDS, SENTENCES, SHOW_AROUND, VOICE_MAIL, DemoConfig, add_options, read
from rapp_cli.errors import UsageError


def config(*words: str, env: dict[str, str] | None = None) -> DemoConfig:
    parser = argparse.ArgumentParser()
    add_options(parser)
    return read(parser.parse_args(words), env or {})


def test_the_keyword_is_said_by_default_and_a_sentence_with_long() -> None:
    assert config().command == KEYWORDS[VOICE_MAIL]
    assert config("--long").command == SENTENCES[VOICE_MAIL]
    assert config("--long", "--say", "please write to my son").command == "please write to my son"


def test_two_runs_write_into_folders_of_their_own(tmp_path: Path) -> None:
    assert config("--folder", str(tmp_path)).folder == tmp_path
    assert "demo" in config().folder.parts


def test_a_recipient_of_any_spelling_gets_a_mail_address() -> None:
    assert config("--recipient", "Doctor Nowak").address == "doctor.nowak@home.example"
    assert config("--recipient", "Żaneta").address.endswith("@home.example")


def test_a_real_account_needs_a_real_recipient() -> None:
    with pytest.raises(UsageError, match="--address"):
        config("--smtp-host", "smtp.example.org")


@pytest.mark.parametrize(("words", "env"), [(("--cloud", "https://x.example"), {}), ((), {"RAPP_CLOUD": "https://x.example"})])
def test_a_platform_that_runs_already_knows_the_address_itself(words: tuple[str, ...], env: dict[str, str]) -> None:
    assert config("--smtp-host", "smtp.example.org", *words, env=env).address == ""
    with pytest.raises(UsageError, match="rapp cloud person contact"):
        config("--address", "me@real.example", *words, env=env)


@pytest.mark.parametrize("name", ["Margaret", "margaret"])
def test_the_recipients_address_goes_before_that_of_a_contact_of_the_same_name(name: str) -> None:
    wished = config("--recipient", f"{name} ", "--address", "me@real.example")
    assert contacts_with(wished.recipient, wished.address) == {name: "me@real.example", "Doctor Nowak": CONTACTS["Doctor Nowak"]}


def test_a_real_account_comes_from_options_before_environment() -> None:
    env = {"RAPP_SMTP_HOST": "env.example", "RAPP_SMTP_USER": "me@env.example", "RAPP_SMTP_PORT": "465"}
    account = config("--smtp-host", "option.example", "--address", "you@x.example", env=env).mail
    assert account is not None
    assert (account.host, account.port, account.user) == ("option.example", 465, "me@env.example")
    assert (account.security, account.sender) == ("starttls", "me@env.example")


def test_nothing_to_say_is_refused() -> None:
    with pytest.raises(UsageError, match="--message"):
        config("--message", "  ")


def test_a_message_that_cannot_be_judged_is_refused() -> None:
    with pytest.raises(UsageError, match="three letters"):
        config("--message", "I am ok")


def test_a_story_has_its_own_words() -> None:
    assert config().story == VOICE_MAIL
    assert config(SHOW_AROUND).command == KEYWORDS[SHOW_AROUND]
    assert config(SHOW_AROUND, "--long").command == SENTENCES[SHOW_AROUND]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--obstacle",), "--obstacle with voice-mail: it is for show-around"),
        ((VOICE_MAIL, "--silent"), "--silent with voice-mail: it is for show-around and hazard"),
        ((HAZARD, "--obstacle"), "--obstacle with hazard"),
        ((SHOW_AROUND, "--door", "0"), "--door with show-around: it is for hazard"),
        ((SHOW_AROUND, "--light", "off"), "--light with show-around"),
        ((VOICE_MAIL, "--mail"), "--mail with voice-mail"),
        ((SHOW_AROUND, "--start", "table"), "--start with show-around"),
        ((SHOW_AROUND, "--obstacle", "--robot", "tcp://nao.local:9559"), "--obstacle with a real robot"),
        ((HAZARD, "--door", "40", "--robot", "tcp://nao.local:9559"), "--door with a real robot"),
        ((SHOW_AROUND, "--silent", "--long"), "leave out --silent or --long"),
        ((HAZARD, "--door", "120"), "by 120 degrees: give 0 to 90"),
    ],
)
def test_options_that_cannot_be_met_are_refused(words: tuple[str, ...], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        config(*words)


def test_door_and_light_are_as_wished() -> None:
    assert (config(HAZARD).door, config(HAZARD).light, config(HAZARD).write) == (40, True, False)
    wished = config(HAZARD, "--door", "0", "--light", "off", "--mail", "--start", "table")
    assert (wished.door, wished.light, wished.write, wished.start) == (0, False, True, "table")
    assert (wished.timeout, config().timeout, config("--timeout", "7").timeout) == (300, 180, 7)
