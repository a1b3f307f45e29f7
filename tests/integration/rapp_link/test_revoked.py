"""The list of RApps that the link brings tells what was revoked: with the real trust client and a store in a folder."""

import asyncio
import errno
import fcntl
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fakes.small_store import package, shelf_with_hello
from fakes.store_client import StoreClient
from rapp_cloud.shelf import Shelf
from rapp_hop.errors import Unreachable
from rapp_hop.hz.delivery import Delivery
from rapp_link.commands import MARGIN, Commands
from rapp_link.config import Config


class Platform:
    """Offers nothing; `away` while it cannot be reached."""

    robot, away = "nao", False

    async def call(self, _service: str, _arguments: dict[str, Any], _timeout: float) -> Any:
        if self.away:
            raise Unreachable("cannot reach the platform")
        return {"rapps": [], "revoked": ["parrot"]}  # what a platform says of revocations counts nothing


class Robot:
    """A robot with hello and maria's clock, and its link."""

    def __init__(self, folder: Path) -> None:
        self.shelf: Shelf = shelf_with_hello(folder)
        self.shelf.custody.add("maria")
        self.shelf.publish(package(folder, "clock"), publisher="maria")
        self.store = StoreClient(folder / "tuf")
        self.delivery = Delivery(self.store, self.shelf.root_file.read_bytes(), folder / "robot")  # type: ignore[arg-type]
        for name in ("hello", "clock"):
            asyncio.run(self.delivery.install(name))
        self.platform = Platform()
        (folder / "robot" / "link").mkdir()
        parts: Any = (Config(home=folder / "robot"), self.platform, self.delivery, None, None, None, None)
        self.commands = Commands(*parts)

    def lists(self) -> dict[str, Any]:
        ticket: Any = SimpleNamespace(remaining=4.0)
        answer: dict[str, Any] = asyncio.run(self.commands.list_rapps({}, ticket))
        return answer

    @property
    def rapps(self) -> set[str]:
        return set(self.delivery.folder.list())


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot(tmp_path)


def test_what_was_revoked_is_told_and_removed(robot: Robot) -> None:
    assert robot.lists() == {"rapps": [], "revoked": []}
    robot.shelf.custody.revoke("maria")
    assert robot.lists()["revoked"] == ["clock"]
    assert robot.rapps == {"hello"}
    robot.platform.away = True
    assert robot.lists() == {"rapps": [], "revoked": ["clock"], "fresh": False}


def test_a_yanked_rapp_stays(robot: Robot) -> None:
    robot.shelf.yank("clock", "1.0.0")
    assert robot.lists()["revoked"] == []
    assert robot.rapps == {"hello", "clock"}


def test_on_a_full_disk_the_list_comes_all_the_same(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    def replace(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    robot.shelf.custody.revoke("maria")
    monkeypatch.setattr(os, "replace", replace)
    assert robot.lists() == {"rapps": [], "revoked": []}
    assert robot.rapps == {"hello", "clock"}


def test_while_another_looks_at_the_store_the_list_comes_all_the_same(robot: Robot, tmp_path: Path) -> None:
    ticket: Any = SimpleNamespace(remaining=MARGIN + 0.2)

    async def story() -> dict[str, Any]:
        with (tmp_path / "robot" / "trust" / ".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            async with asyncio.timeout(20):
                answer: dict[str, Any] = await robot.commands.list_rapps({}, ticket)
        return answer

    assert asyncio.run(story()) == {"rapps": [], "revoked": []}


def test_without_its_store_the_list_comes_all_the_same(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "tuf" / "metadata" / "timestamp.json").write_bytes(b"{")
    assert robot.lists() == {"rapps": [], "revoked": []}
    assert robot.rapps == {"hello", "clock"}
