"""A new version that does not start, or cannot be installed, or must not run."""

import shutil
from typing import Any

import pytest

from fakes.agents import FakeAgent, Script
from fakes.core_home import KEYWORD, Home, ask
from fakes.rapps import install_rapp, write_rapp
from rapp_core.errors import CoreError, Invalid, Refused, Unreachable

BACK = "The new version did not start, the one before is back"


def update(home: Home, **rapp: Any) -> None:
    """The platform offers clock 2.0.0; 1.0.0 has run here."""
    old = install_rapp(home.config.home, "clock", keywords=("what time is it",))
    home.link.catalogue[0]["version"] = "2.0.0"
    new = write_rapp(old.parent / "2.0.0", "clock", version="2.0.0", keywords=("what time is it",), **rapp)
    home.link.answers["started"] = {"back": "1.0.0"}

    def install(_arguments: object) -> dict[str, Any]:
        (old.parent / "previous").symlink_to("1.0.0")
        (old.parent / "current").unlink()
        (old.parent / "current").symlink_to("2.0.0")
        return {"name": "clock", "version": "2.0.0", "path": str(new), "installed": True}

    home.link.answers["install"] = install
    home.start()
    ask(home)


@pytest.mark.parametrize(
    "script",
    [Script(first_word=None, terminate=0.1, outcome=("failed", "SyntaxError")), Script(first_word=None, terminate=None, crash=0.1)],
)
def test_a_new_version_that_does_not_start_gives_way_and_the_robot_says_so(home: Home, script: Script) -> None:
    home.agents.script = script
    update(home)
    assert home.round()[-3:] == ["s10", "s11", "s3"]
    assert home.fake.said() == [BACK]
    ((_, told),) = [asked for asked in home.link.asked if asked[0] == "started"]
    assert (told["name"], told["version"], told["ok"]) == ("clock", "2.0.0", False)


def test_a_new_version_that_cannot_be_read_gives_way(home: Home) -> None:
    home.agents.error = Invalid("cannot use it: its package.json is broken")
    update(home)
    home.round()
    assert home.fake.said() == [BACK]


def test_a_new_version_that_has_started_stays(home: Home) -> None:
    update(home)
    home.link.answers["started"] = {"back": None}
    assert home.round() == KEYWORD
    assert [told["ok"] for name, told in home.link.asked if name == "started"] == [True]


@pytest.mark.parametrize("error", [Refused("cannot install clock: No space left on device"), Unreachable("cannot reach it")])
def test_when_an_update_cannot_be_installed_the_version_that_is_here_runs(home: Home, error: Exception) -> None:
    update(home)
    home.link.errors["install"] = error  # type: ignore[assignment]
    assert home.round() == KEYWORD
    assert "activate 1.0.0" in home.fake.journal
    assert home.fake.said() == []


def test_when_an_update_is_broken_the_robot_says_so_and_the_version_that_is_here_runs(home: Home) -> None:
    update(home)
    home.link.errors["install"] = Invalid("cannot unpack clock: the archive is damaged")
    assert home.round() == KEYWORD
    assert "activate 1.0.0" in home.fake.journal
    assert home.fake.said() == ["The new version cannot be used, I take the one before"]


def test_when_an_update_is_not_to_be_trusted_nothing_runs(home: Home) -> None:
    error = Invalid("cannot trust the store")
    error.reason = "rollback"
    update(home)
    home.link.errors["install"] = error
    home.round()
    assert home.fake.said() == ["I refuse to install clock, it is older than what I had"]
    assert home.agents.runs == []


@pytest.mark.parametrize("left", [False, True], ids=["removed", "still on the disk"])
@pytest.mark.parametrize(
    ("error", "reason", "said"),
    [
        (Invalid("no"), "revoked key", "I refuse to install clock, who made it is not trusted any more"),
        (Invalid("broken"), "", "I cannot install clock"),
        (Refused("no such RApp"), "", "I cannot install clock"),
        (Unreachable("away"), "", "I cannot reach the platform"),
    ],
)
def test_what_was_revoked_is_never_started_and_the_robot_says_so(
    home: Home, error: CoreError, reason: str, said: str, left: bool
) -> None:
    error.reason = reason
    path = install_rapp(home.config.home, "clock", keywords=("what time is it",))

    def revoke(_arguments: object) -> dict[str, Any]:
        if not left:
            shutil.rmtree(path.parent)
        return {"rapps": [], "revoked": ["clock"]}

    home.link.answers["list_rapps"] = revoke
    home.link.errors["install"] = error
    home.start()
    ask(home)
    assert home.round() == ["s3", "s4", "s6", "s11", "s3"]
    assert home.fake.said() == [said]
    assert home.agents.runs == []


def test_a_new_version_is_not_blamed_for_a_platform_that_cannot_start_its_part_in_the_cloud(home: Home) -> None:
    def initialising(agent: FakeAgent) -> None:
        agent._told({"type": "state", "machine": "dynamic", "state": "s2", "kind": "entered", "detail": ""})

    home.link.errors["start_cloud_agent"] = Refused("cannot start clock_cloud: the platform is full")
    home.link.answers["stop_cloud_agent"] = {"stopped": False}
    home.agents.script = Script(terminate=0.3, outcome=("failed", "no cloud agent"), acts=[(0.2, initialising)])
    update(home, partner="clock_cloud")
    home.round()
    assert home.fake.said() == ["I cannot start its part in the cloud"]
    assert "started" not in home.link.names()
