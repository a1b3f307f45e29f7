"""The page on which a person tries the services, in a real browser: Debian's chromium."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.wait import WebDriverWait

from fakes.browser import PATIENCE, browser
from fakes.hop_house import TOKEN, house
from rapp_hop.service import Service, service


@service
def mix(text: str, count: int = 3, loud: bool = False, names: list[str] | None = None) -> str:
    """Mix things."""
    return f"{text}|{count}|{loud}|{names}"


@service
def nasty() -> str:
    """Answer with <script>markup</script>."""
    return "<img src=x onerror=\"document.title='hurt'\"><script>document.title='hurt'</script>"


@contextmanager
def open_house(folder: Path, *more: Service) -> Iterator[int]:
    """A house whose loop runs in a thread, as the browser's driver waits."""
    ports: list[int] = []
    ready, end = threading.Event(), threading.Event()

    async def serve() -> None:
        async with house(folder, *more) as one:
            ports.append(one.port)
            ready.set()
            await asyncio.to_thread(end.wait)

    thread = threading.Thread(target=asyncio.run, args=(serve(),))
    thread.start()
    try:
        assert ready.wait(PATIENCE)
        yield ports[0]
    finally:
        end.set()
        thread.join(PATIENCE)


class Page:
    """What a person sees."""

    def __init__(self, driver: Chrome, port: int) -> None:
        self._driver = driver
        self._wait = WebDriverWait(driver, PATIENCE, poll_frequency=0.05)
        driver.get(f"http://127.0.0.1:{port}/hop/")

    def enter(self, token: str) -> str:
        field = self._driver.find_element(By.ID, "token")
        field.clear()
        field.send_keys(token)
        self._driver.find_element(By.CSS_SELECTOR, "#enter button").click()
        said = self._driver.find_element(By.ID, "said")
        self._wait.until(lambda _: said.text)
        return said.text

    def form(self, name: str) -> WebElement:
        form = self._driver.find_element(By.CSS_SELECTOR, f"#{name}")
        if form.get_attribute("open") is None:
            form.find_element(By.TAG_NAME, "summary").click()
        return form

    def call(self, name: str, **fields: str) -> tuple[str, bool]:
        """Fill in a service's form and call; what is shown, and whether as an error."""
        form = self.form(name)
        for field, value in fields.items():
            place = form.find_element(By.NAME, field)
            if place.get_attribute("type") == "checkbox":
                place.click()
                continue
            if place.get_attribute("type") != "file":
                place.clear()
            place.send_keys(value)
        form.find_element(By.TAG_NAME, "button").click()
        output = form.find_element(By.TAG_NAME, "pre")
        self._wait.until(lambda _: output.is_displayed() and form.find_element(By.TAG_NAME, "button").is_enabled())
        return output.text, "error" in (output.get_attribute("class") or "")


@pytest.mark.timeout(300)
def test_a_person_tries_each_service_in_a_browser(tmp_path: Path) -> None:
    (tmp_path / "door.jpg").write_bytes(b"12345")
    with open_house(tmp_path, mix, nasty) as port, browser(tmp_path) as driver:
        page = Page(driver, port)
        assert "Accept-Token" in page.enter("wrong")
        assert page.enter(TOKEN) == "11 services"
        shown, wrong = page.call("add", a="2")
        assert (shown.splitlines()[0], wrong) == ("3", False)
        assert page.call("mix", text="a b", loud="x", names='["x", "y"]')[0].startswith("\"a b|3|True|['x', 'y']\"")
        shown, wrong = page.call("measure", label="no file")
        assert wrong and "invalid: cannot call measure: parameter file is missing" in shown
        shown, wrong = page.call("measure", file=str(tmp_path / "door.jpg"), label="front")
        assert not wrong and '"size": 5' in shown and '"suffix": ".jpg"' in shown and '"label": "front"' in shown
        shown, wrong = page.call("add", a='"two"')
        assert wrong and "invalid: cannot call add: parameter a must be a whole number" in shown
        shown, wrong = page.call("add", a="{")
        assert wrong and shown.startswith("cannot call /hop/add")
        shown, wrong = page.call("broken")
        assert wrong and shown.startswith("bug: cannot finish the call") and "secret" not in shown
        shown, wrong = page.call("numbers", count="3")
        assert not wrong and "save the file (30 bytes)" in shown
        shown, wrong = page.call("nasty")
        assert "<script>" in shown and driver.title == "HOP services"  # text, never markup
        assert "<script>" in page.form("nasty").find_element(By.TAG_NAME, "summary").text
        entries = driver.execute_script("return performance.getEntriesByType('resource').map(one => new URL(one.name).host)")
        assert set(entries) == {f"127.0.0.1:{port}"}
        severe = [line["message"] for line in driver.get_log("browser") if line["level"] == "SEVERE"]
        assert not [line for line in severe if "Failed to load resource" not in line], severe
