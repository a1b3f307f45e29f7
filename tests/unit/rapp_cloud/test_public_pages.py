"""What strangers may ask for is made once for each state of the store, not for each stranger."""

import asyncio
from collections.abc import Callable
from datetime import datetime, timedelta, tzinfo
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import source_folder
from rapp_cli.__main__ import main
from rapp_cloud import store_page, weblets
from rapp_cloud.catalogue import RobotKind
from rapp_cloud.shelf import Expiry, Shelf
from rapp_cloud.views import Views
from rapp_hop.errors import Refused
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


class Later(datetime):
    """A clock of thousand days from now."""

    @classmethod
    def now(cls, tz: tzinfo | None = None) -> datetime:
        return datetime.now(tz) + timedelta(days=1000)


def test_what_robots_refuse_as_its_list_has_run_out_is_told_and_not_offered(
    shelf: Shelf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shelf.custody.add("maria")
    shelf.publish(build(source_folder(tmp_path, "clock")), "maria")
    long = Shelf(tmp_path / "tuf", tmp_path / "keys", Expiry(targets=timedelta(days=2000)))
    long.publish(build(source_folder(tmp_path, "parrot")))
    views, page, listed = Views(shelf.believed), store_page.store_page(shelf), weblets.weblets(shelf, "https")

    def seen() -> tuple[list[str], list[bool], list[bool]]:
        offered = [each["name"] for each in views.described(RobotKind("nao", "1.0"))]
        main(["store", "list", "--data", str(tmp_path)])
        text = asked(page) + capsys.readouterr().out
        told = [words in text for words in ("maria: the list has run out", "maria must sign again")]
        return offered, told, [f"{name}-1.0.0.hz" in asked(listed, "synclist") for name in ("clock", "hello")]

    assert seen() == (["clock", "hello", "parrot"], [False, False], [True, True])
    monkeypatch.setattr("rapp_cloud.shelf.datetime", Later)
    assert seen() == (["hello", "parrot"], [True, True], [False, True])
    with pytest.raises(Refused, match="is what one says for clock"):
        shelf.publish(build(source_folder(tmp_path, "owl", keywords={"en": ["clock"]})))


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
