"""The home's folder and what is kept in it."""

from pathlib import Path

import pytest

from rapp_cli.errors import CommandError, UsageError
from rapp_cli.home.place import Home, Settings, default_folder
from rapp_cli.mail_account import MailAccount

PORTS = {"roscore": 1, "nao_sim": 2, "rosbridge": 3, "cloud": 4, "mail": 5}
ACCOUNT = MailAccount("smtp.example", 587, "me", "starttls", Path("/run/password"), "me@example.org")


@pytest.mark.parametrize("mail", [None, ACCOUNT])
def test_settings_are_kept_whole(tmp_path: Path, mail: MailAccount | None) -> None:
    home, settings = Home(tmp_path), Settings("nao", None, None, mail, ("--no-world",), PORTS)
    home.keep(settings)
    assert home.settings() == settings
    assert home.settled() == settings


def test_a_home_without_settings_names_the_command_that_makes_them(tmp_path: Path) -> None:
    assert Home(tmp_path).settings() is None
    with pytest.raises(CommandError, match=r"\./rapp up --home"):
        Home(tmp_path).settled()


def test_settings_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    (tmp_path / "settings.json").write_text('{"mail": null}')
    with pytest.raises(CommandError, match="remove it"):
        Home(tmp_path).settings()


def test_commands_name_the_home_only_when_it_is_not_the_default() -> None:
    assert Home(default_folder()).command("down") == "./rapp down"
    assert Home(Path("/a b")).command("down") == "./rapp down --home '/a b'"


def test_the_folders_are_for_the_user_alone(tmp_path_factory: pytest.TempPathFactory) -> None:
    home = Home(tmp_path_factory.mktemp("user") / "home")
    home.make()
    assert (home.folder.stat().st_mode & 0o777, home.supervision.stat().st_mode & 0o777) == (0o700, 0o700)


@pytest.mark.parametrize("name", ["a;b", "50%", 'a"b', "x" * 100])
def test_places_that_supervisor_or_sockets_cannot_take_are_refused(tmp_path: Path, name: str) -> None:
    home = Home(tmp_path / name)
    with pytest.raises(UsageError, match="--home"):
        home.make()
    assert not home.folder.exists()
