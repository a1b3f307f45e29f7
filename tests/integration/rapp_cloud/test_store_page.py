"""The store's page in a real browser: what people are told of each RApp, and that no package can put a script on it."""

import asyncio
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By

from fakes.browser import browser
from fakes.packages import source_folder
from rapp_cloud.shelf import Shelf
from rapp_cloud.store_page import store_page
from rapp_hop.hz.archive import build
from rapp_hop.registry import ServiceRegistry
from rapp_hop.server import HopServer

EVIL = "<img src=x onerror=\"document.title='evil'\"><script>document.title='evil'</script>&amp;"


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.create()
    shelf.custody.add("maria")
    return shelf


@pytest.fixture
def address(shelf: Shelf, tmp_path: Path) -> Iterator[str]:
    loop, ready, ports = asyncio.new_event_loop(), threading.Event(), []
    stop = asyncio.Event()

    async def serve() -> None:
        server = HopServer(ServiceRegistry([]), lambda _: None, tmp_path / "uploads", [store_page(shelf)])
        ports.append(server.listen(0))
        ready.set()
        await stop.wait()
        await server.close()

    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    assert ready.wait(20)
    yield f"http://127.0.0.1:{ports[0]}/store"
    loop.call_soon_threadsafe(stop.set)
    thread.join(20)
    loop.close()


@pytest.fixture(name="browser")
def running_browser(tmp_path: Path) -> Iterator[Chrome]:
    with browser(tmp_path) as driver:
        yield driver


def put(shelf: Shelf, folder: Path, name: str, version: str = "1.0.0", publisher: str | None = None, **rapp: Any) -> None:
    words = {"keywords": {"en": [f"{name} please"]}, "sentences": {"en": []}, **rapp}
    shelf.publish(build(source_folder(folder, name, version, **words)), publisher)


def test_people_are_told_what_a_rapp_is(shelf: Shelf, address: str, browser: Chrome, tmp_path: Path) -> None:
    browser.get(address)
    assert "The store is empty" in browser.find_element(By.TAG_NAME, "body").text
    put(shelf, tmp_path, "clock", publisher="maria")
    put(shelf, tmp_path, "clock", "1.1.0", sentences={"de": [EVIL]}, permissions={"core": ["rapp_say"], "cloud": ["profile"]})
    put(shelf, tmp_path, "mind_cloud", agent="cloud", keywords={}, sentences={}, permissions={"core": [], "cloud": []})
    put(shelf, tmp_path, "mind", partner="mind_cloud")
    browser.get(address)
    assert browser.title == "RApp store"
    articles = browser.find_elements(By.TAG_NAME, "article")
    assert [article.find_element(By.TAG_NAME, "h2").text for article in articles] == ["clock 1.1.0", "mind 1.0.0"]
    names = [item.text for item in articles[0].find_elements(By.TAG_NAME, "dt")]
    values = [item.text for item in articles[0].find_elements(By.TAG_NAME, "dd")]
    facts = dict(zip(names, values, strict=True))
    assert facts == {
        "Say": f"clock please, {EVIL}",
        "Runs on": "nao with API >=1.0",
        "May use": "rapp_say profile",
        "Made by": "unknown",
        "Signed by": "maria",
        "Versions": "1.1.0 1.0.0",
    }
    assert not browser.find_elements(By.TAG_NAME, "script") + browser.find_elements(By.TAG_NAME, "img")
    style = browser.execute_script("return getComputedStyle(document.querySelector('dl')).display")
    assert style == "grid"  # the policy lets its own style through
    assert [entry for entry in browser.get_log("browser") if "favicon" not in entry["message"]] == []
