"""`./rapp remove` against the real bridge and the real link."""

import argparse
from collections.abc import Callable
from typing import Any

import pytest

from fakes.rapps import install_rapp
from rapp_cli.errors import CommandError
from rapp_cli.home import remove
from rapp_cli.home.place import Home, Settings
from rapp_cloud.app import open_shelf
from rapp_core.config import Config
from rapp_core.control.quarantine import Quarantine


@pytest.fixture
def home(start: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Home:
    """A robot with bridge and link that trusts a store; the clock is installed, and has failed once."""
    home = Home(tmp_path_factory.mktemp("x"))  # a short path: a socket belongs to it
    home.make()
    open_shelf(home.cloud).create()
    bridge = start("rapp_bridge", "--port", "0").ready["port"]
    home.keep(Settings("nao", None, None, None, (), {"rosbridge": bridge}))
    root = home.cloud / "tuf" / "metadata" / "1.root.json"
    start("rapp_link", "--bridge", f"ws://127.0.0.1:{bridge}", "--home", str(home.robot), "--root-file", str(root))
    install_rapp(home.robot, "clock")
    Quarantine(Config(home=home.robot)).failed("clock", "1.0.0", "it has crashed")
    return home


def removes(home: Home, name: str = "clock") -> int:
    return remove.run(argparse.Namespace(rapp=name, home=home.folder))


def forgotten(home: Home) -> bool:
    return not Quarantine(Config(home=home.robot)).forget("clock")


def test_a_removed_rapp_is_gone_with_its_failures_and_keepsakes_stay(home: Home, capsys: pytest.CaptureFixture[str]) -> None:
    kept = home.robot / "keepsakes" / "clock" / "tower.png"
    kept.parent.mkdir(parents=True)
    kept.write_bytes(b"x")
    assert removes(home) == 0
    assert capsys.readouterr().out == f"clock 1.0.0 is removed; kept: {kept.parent}\n"
    assert not (home.robot / "rapps" / "clock").exists()
    assert kept.exists()
    assert forgotten(home)
    with pytest.raises(CommandError, match="not installed"):
        removes(home)


def test_a_rapp_that_runs_is_not_removed(home: Home) -> None:
    package = home.robot / "runs" / "r1" / "package"
    package.mkdir(parents=True)
    (package / "package.json").write_text('{"name": "clock"}')
    with pytest.raises(CommandError, match="cannot remove clock: it runs"):
        removes(home)
    assert (home.robot / "rapps" / "clock").exists()
    assert not forgotten(home)
