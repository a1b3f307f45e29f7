"""Files that a RApp leaves to the person: by RApp and name, bounded in size, whole or not at all."""

from dataclasses import replace
from pathlib import Path

import pytest

from fakes.agents import FakeAgent, Script
from fakes.clock import Clock
from fakes.rapps import write_rapp
from rapp_core.config import Config, Limits
from rapp_core.errors import Invalid, Refused, Unreachable
from rapp_core.manifest import read_manifest
from rapp_core.services.keepsakes import BLOCK, Keepsakes

LIMITS = Limits(kept=4 * BLOCK, kept_file=2 * BLOCK)


def agent(folder: Path, name: str = "painter") -> FakeAgent:
    package = write_rapp(folder / "run" / name / "package", name)
    return FakeAgent(Clock(), folder / "run" / name, read_manifest(package), Script(), [], lambda _message: None)


@pytest.fixture
def keepsakes(tmp_path: Path) -> Keepsakes:
    return Keepsakes(Config(home=tmp_path, limits=LIMITS))


def test_a_file_is_kept_under_its_rapp_and_replaced_by_a_newer_one(tmp_path: Path, keepsakes: Keepsakes) -> None:
    painter = agent(tmp_path)
    path = keepsakes.keep(painter, "table.jpg", b"old")
    assert keepsakes.keep(painter, "table.jpg", b"new") == path == tmp_path / "keepsakes" / "painter" / "table.jpg"
    assert path.read_bytes() == b"new"
    keepsakes.keep(agent(tmp_path, "other"), "table.jpg", b"another")
    assert path.read_bytes() == b"new"
    assert [file.name for file in path.parent.iterdir()] == ["table.jpg"]


@pytest.mark.parametrize("name", ["", ".hidden", "../up.jpg", "a/b", "/etc/x", "x" * 65, "a b", "a\0b", "a\n"])
def test_a_name_that_is_no_plain_one_is_invalid(tmp_path: Path, keepsakes: Keepsakes, name: str) -> None:
    with pytest.raises(Invalid):
        keepsakes.keep(agent(tmp_path), name, b"x")


def test_one_file_and_all_of_a_rapp_are_bounded(tmp_path: Path, keepsakes: Keepsakes) -> None:
    painter = agent(tmp_path)
    with pytest.raises(Refused, match="make it smaller"):
        keepsakes.keep(painter, "big", bytes(2 * BLOCK + 1))
    keepsakes.keep(painter, "one", bytes(2 * BLOCK))
    keepsakes.keep(painter, "two", b"small")
    keepsakes.keep(painter, "three", b"small")
    with pytest.raises(Refused, match="older file"):
        keepsakes.keep(painter, "four", b"")
    keepsakes.keep(painter, "one", bytes(2 * BLOCK))
    keepsakes.keep(agent(tmp_path, "other"), "four", b"x")


def test_a_rapp_whose_name_would_lead_elsewhere_is_refused(tmp_path: Path, keepsakes: Keepsakes) -> None:
    painter = agent(tmp_path)
    assert painter.manifest is not None
    painter.manifest = replace(painter.manifest, name="../other")
    with pytest.raises(Refused):
        keepsakes.keep(painter, "table.jpg", b"x")


def test_a_disk_that_does_not_take_it_is_unreachable(tmp_path: Path, keepsakes: Keepsakes) -> None:
    (tmp_path / "keepsakes").write_text("in the way")
    with pytest.raises(Unreachable):
        keepsakes.keep(agent(tmp_path), "table.jpg", b"x")
