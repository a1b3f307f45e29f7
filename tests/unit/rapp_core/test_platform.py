"""What the core agent knows of platform and installed RApps."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from fakes.link import FakeLink
from fakes.rapps import install_rapp
from rapp_core.config import Config
from rapp_core.control.platform import Platform
from rapp_core.errors import Refused


def entry(name: str, version: str = "1.0.0", **more: Any) -> dict[str, Any]:
    return {"name": name, "version": version, "description": "", "keywords": {"en": [name]}, "sentences": {"en": []}, **more}


@pytest.fixture
def link() -> FakeLink:
    return FakeLink(catalogue=[entry("clock"), entry("drone", compatible=False, reasons=["needs a drone"])])


@pytest.fixture
def platform(link: FakeLink, tmp_path: Path) -> Platform:
    return Platform(link, Config(home=tmp_path, name="nao7"))


def test_registers_under_its_name_then_reads_the_catalogue(platform: Platform, link: FakeLink) -> None:
    assert platform.attempt()
    assert link.asked == [("register", {"robot": "nao7", "kind": "nao", "api_version": "1.0"}), ("list_rapps", {})]


def test_only_what_fits_this_robot_can_be_asked_for(platform: Platform) -> None:
    platform.attempt()
    assert {name: known.keywords for name, known in platform.rapps().items()} == {"clock": ("clock",)}


def test_once_registered_only_the_catalogue_is_read_again(platform: Platform, link: FakeLink) -> None:
    platform.attempt()
    link.catalogue.append(entry("parrot"))
    platform.attempt()
    assert link.names() == ["register", "list_rapps", "list_rapps"]
    assert set(platform.rapps()) == {"clock", "parrot"}


def test_changes_of_the_catalogue_are_counted(platform: Platform, link: FakeLink) -> None:
    counts = []
    for _ in range(2):
        platform.attempt()
        counts.append(platform.changes)
    link.catalogue[0]["version"] = "2.0.0"
    platform.attempt()
    assert [*counts, platform.changes] == [1, 1, 2]


def test_while_the_platform_is_away_installed_rapps_are_known(platform: Platform, link: FakeLink, tmp_path: Path) -> None:
    link.away = True
    install_rapp(tmp_path, "clock", keywords=("what time is it",))
    assert not platform.attempt()
    assert platform.rapps()["clock"].keywords == ("what time is it",)


def test_after_a_failure_it_registers_anew(platform: Platform, link: FakeLink) -> None:
    platform.attempt()
    link.errors["list_rapps"] = Refused("cannot list: this robot is not registered")
    assert not platform.attempt()
    del link.errors["list_rapps"]
    assert platform.attempt()
    assert link.names() == ["register", "list_rapps", "list_rapps", "register", "list_rapps"]


def test_a_broken_catalogue_keeps_the_old_one(platform: Platform, link: FakeLink) -> None:
    platform.attempt()
    link.answers["list_rapps"] = {"rapps": [{"name": "clock"}]}
    assert not platform.attempt()
    assert set(platform.rapps()) == {"clock"}


def test_an_installed_rapp_of_the_offered_version_runs_without_download(platform: Platform, tmp_path: Path) -> None:
    platform.attempt()
    assert platform.runnable("clock") is None
    path = install_rapp(tmp_path, "clock")
    known = platform.runnable("clock")
    assert known is not None
    assert known.path == path


def test_a_newer_offer_is_downloaded(platform: Platform, link: FakeLink, tmp_path: Path) -> None:
    install_rapp(tmp_path, "clock")
    link.catalogue[0]["version"] = "1.1.0"
    platform.attempt()
    assert platform.runnable("clock") is None


def test_a_newer_offer_is_asked_for_by_its_own_words_too(platform: Platform, link: FakeLink, tmp_path: Path) -> None:
    install_rapp(tmp_path, "clock", keywords=("what time is it",))
    link.catalogue[0] |= {"version": "1.1.0", "keywords": {"en": ["clock"]}}
    platform.attempt()
    known = platform.rapps()["clock"]
    assert (known.version, set(known.keywords)) == ("1.0.0", {"what time is it", "clock"})


def test_what_was_revoked_is_not_run_and_still_understood(platform: Platform, link: FakeLink, tmp_path: Path) -> None:
    for name in ("parrot", "owl"):
        install_rapp(tmp_path, name)
    link.answers["list_rapps"] = {"rapps": [], "revoked": ["parrot", "crow"]}
    platform.attempt()
    assert platform.runnable("parrot") is None  # though the link has not removed it
    assert {name: (known.keywords, known.path is None) for name, known in platform.rapps().items()} == {
        "owl": (("owl",), False), "parrot": (("parrot",), True),
    }  # fmt: skip
    shutil.rmtree(tmp_path / "rapps" / "parrot")
    link.answers["list_rapps"] = {"rapps": [], "revoked": []}
    platform.attempt()
    assert platform.rapps()["parrot"].keywords == ("parrot",)


def test_what_was_revoked_is_never_run_beside_another_version_on_offer(platform: Platform, link: FakeLink, tmp_path: Path) -> None:
    install_rapp(tmp_path, "parrot")
    link.answers["list_rapps"] = {"rapps": [entry("parrot", "2.0.0")], "revoked": ["parrot"]}  # the link cannot remove it
    for _ in range(3):
        platform.attempt()
        known = platform.rapps()["parrot"]
        assert (known.version, known.path) == ("2.0.0", None)


def test_a_revoked_rapp_that_is_on_offer_again_is_as_any_other(platform: Platform, link: FakeLink, tmp_path: Path) -> None:
    path = install_rapp(tmp_path, "parrot")
    link.answers["list_rapps"] = {"rapps": [], "revoked": ["parrot"]}
    platform.attempt()
    link.answers["list_rapps"] = {"rapps": [entry("parrot")], "revoked": []}
    platform.attempt()
    known = platform.runnable("parrot")
    assert known is not None and known.path == path


def test_a_broken_installation_hides_no_other(platform: Platform, tmp_path: Path) -> None:
    install_rapp(tmp_path, "parrot")
    (install_rapp(tmp_path, "clock") / "package.json").write_text('{"name": "clock"')
    (tmp_path / "rapps" / "half").mkdir()
    assert set(platform.rapps()) == {"parrot"}


def test_an_entry_outside_of_the_package_is_no_rapp(platform: Platform, tmp_path: Path) -> None:
    install_rapp(tmp_path, "clock", entry="../../../escape.py")
    assert platform.rapps() == {}
