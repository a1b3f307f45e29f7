"""Settings of the core agent: file, then environment, then options."""

import tomllib
from dataclasses import asdict
from pathlib import Path

import pytest

from rapp_core.config import Config, Limits, read
from rapp_core.errors import Invalid

SHIPPED = Path(__file__).parents[3] / "catkin_ws" / "src" / "rapp_core" / "config" / "core_agent.toml"


def write(folder: Path, text: str) -> str:
    path = folder / "core.toml"
    path.write_text(text)
    return str(path)


def test_options_go_before_environment_before_file(tmp_path: Path) -> None:
    file = write(tmp_path, 'robot = "tcp://file:1"\nname = "file"\nhang = 3\n')
    config = read(["--config", file, "--robot", "tcp://option:1"], {"RAPP_ROBOT": "tcp://env:1", "RAPP_HOME": str(tmp_path)})
    assert (config.robot, config.name, config.hang, config.home) == ("tcp://option:1", "file", 3, tmp_path)
    assert read(["--config", file], {"RAPP_ROBOT": "tcp://env:1"}).robot == "tcp://env:1"
    assert read(["--config", file], {}).robot == "tcp://file:1"


def test_limits_are_a_table_of_their_own(tmp_path: Path) -> None:
    limits = read(["--config", write(tmp_path, "[limits]\ncpu = 5\n")], {}).limits
    assert limits == Limits(cpu=5)


@pytest.mark.parametrize(
    "text",
    ["hangs = 1", 'hang = "1"', "hang = true", "hang = 0", "hang = -1", "hang = nan", "name = 1", "[limits]\ncpu = 1.5", "x ="],
)
def test_a_wrong_file_is_refused_by_name(tmp_path: Path, text: str) -> None:
    file = write(tmp_path, text)
    with pytest.raises(Invalid, match=r"core\.toml"):
        read(["--config", file], {})


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Invalid):
        read(["--config", str(tmp_path / "none.toml")], {})


def test_the_shipped_file_shows_every_default() -> None:
    shipped = tomllib.loads(SHIPPED.read_text())
    expected = asdict(Config())
    del expected["home"]  # depends on the user
    assert shipped == expected
    assert read(["--config", str(SHIPPED)], {}) == read([], {})
