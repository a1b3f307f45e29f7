"""A robot with a version installed, and a store with a newer one, to be attacked."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import source_folder
from fakes.repository import Repository
from fakes.store_robot import Robot
from rapp_hop.hz.archive import build


@pytest.fixture
def package(tmp_path: Path) -> Callable[..., bytes]:
    def make(version: str, name: str = "hello", **rapp: Any) -> bytes:
        return build(source_folder(tmp_path / "sources" / name / version, name, version, f"print({version!r})\n", **rapp))

    return make


@pytest.fixture
def repository(package: Callable[..., bytes]) -> Repository:
    repository = Repository()
    repository.publish("hello", "1.0.0", package("1.0.0"))
    return repository


@pytest.fixture
def robot(repository: Repository, package: Callable[..., bytes], tmp_path: Path) -> Robot:
    robot = Robot(repository, tmp_path / "robot")
    assert robot.gets() == "1.0.0"
    robot.old = dict(repository.files)
    repository.publish("hello", "1.1.0", package("1.1.0"))
    return robot
