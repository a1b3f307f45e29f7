"""What strangers may ask for is made once for each state of the store, not for each stranger."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import source_folder
from rapp_cloud import store_page, weblets
from rapp_cloud.shelf import Shelf
from rapp_hop.hz.archive import build
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireRequest


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.create()
    shelf.publish(build(source_folder(tmp_path)))
    return shelf


def asked(mount: Mount, rest: str = "", host: str = "here") -> str:
    request = WireRequest("GET", mount.prefix + rest, {"host": host}, b"")
    answer = asyncio.run(mount.handler(Visit("", rest, request, "192.0.2.1")))  # type: ignore[arg-type]
    assert answer.status == 200 and isinstance(answer.body, bytes)
    return answer.body.decode()


def counting(monkeypatch: pytest.MonkeyPatch, module: Any, name: str) -> list[str]:
    """The calls of a function that goes on doing what it does."""
    calls: list[str] = []
    before: Callable[..., Any] = getattr(module, name)
    monkeypatch.setattr(module, name, lambda *arguments: (calls.append(name), before(*arguments))[1])
    return calls


def test_the_page_is_rendered_when_the_store_changes(shelf: Shelf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls, mount = counting(monkeypatch, store_page, "render"), store_page.store_page(shelf)
    assert asked(mount) == asked(mount)
    assert len(calls) == 1
    shelf.publish(build(source_folder(tmp_path, "parrot")))
    assert "parrot" in asked(mount)
    assert len(calls) == 2


def test_the_list_of_weblets_too_for_whichever_host(shelf: Shelf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls, mount = counting(monkeypatch, weblets, "synclist"), weblets.weblets(shelf, "https")
    assert '(url "https://one:9001/hop/weblets/download?weblet=hello-1.0.0.hz")' in asked(mount, "synclist", "one:9001")
    assert '"https://\\"two/hop/weblets/download?' in asked(mount, "synclist", '"two')
    assert len(calls) == 1
    shelf.publish(build(source_folder(tmp_path, "parrot")))
    assert "parrot-1.0.0.hz" in asked(mount, "synclist")
    assert len(calls) == 2
