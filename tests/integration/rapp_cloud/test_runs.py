"""Runs as people see them: by the service, by `./rapp runs`, and on the page in a real browser."""

import asyncio
import json
import time
from collections.abc import Iterator

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.support.wait import WebDriverWait

from fakes.browser import PATIENCE, browser
from fakes.cloud_process import CloudProcess, cloud_process
from rapp_cli.__main__ import main as rapp
from rapp_cloud.memory import open_memory
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError

EVIL = "<img src=x onerror=\"document.title='hurt'\"><script>document.title='hurt'</script>"
DONE = {
    "run": "r-1", "rapp": "voice_mail", "version": "1.2.0", "outcome": "done", "began": 1_700_000_000.5, "seconds": 12.25,
    "states": [{"agent": "core", "machine": "core", "state": "s9", "at": 0.5, "seconds": 11.0},
               {"agent": "dynamic", "machine": "voice_mail", "state": "s31", "at": 0.75, "seconds": 1.5}],
    "errors": [], "versions": {"api": "1.0"},
}  # fmt: skip
FAILED = {
    "run": "r-2",
    "rapp": EVIL,
    "outcome": "failed",
    "errors": [{"agent": "dynamic", "state": state, "detail": EVIL + "\x1b[2J"} for state in ("s31", "s3")],
}
ODD = {"run": "r-3", "began": "x", "seconds": 1e300, "states": "x", "errors": [3, {}], "rapp": ["x"]}


@pytest.fixture(scope="module")
def cloud(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CloudProcess]:
    """With four runs of two robots, and a person who may see them."""
    folder = tmp_path_factory.mktemp("runs")
    with cloud_process(folder, []) as cloud:

        async def report(nao: HopClient, other: HopClient) -> None:
            for run in (DONE, FAILED, ODD, DONE):
                assert await nao.call("report", {"run": run}) == {"kept": True}
            await other.call("register", {"kind": "nao", "api_version": "1.0"})
            await other.call("report", {"run": {"run": "r-1", "rapp": "clock", "outcome": "done"}})

        cloud.run(report)
        yield cloud


@pytest.fixture(scope="module")
def reader(cloud: CloudProcess) -> str:
    with open_memory(cloud.data) as memory:
        memory.admission.enrol("maria", "user", "correct horse")
        token = memory.accounts.give("maria")

    async def until_known() -> None:
        client = HopClient(f"http://127.0.0.1:{cloud.port}", token)
        try:
            async with asyncio.timeout(PATIENCE):
                while True:
                    try:
                        await client.call("runs")
                        return
                    except HopError:
                        await asyncio.sleep(0.1)
        finally:
            await client.close()

    asyncio.run(until_known())
    return token


def test_a_robot_sees_its_own_and_each_run_once(cloud: CloudProcess) -> None:
    async def ask(nao: HopClient, other: HopClient) -> None:
        assert [run["run"] for run in (await nao.call("runs"))["runs"]] == ["r-1", "r-3", "r-2"]
        assert [(run["robot"], run["rapp"]) for run in (await other.call("runs"))["runs"]] == [("other", "clock")]
        assert len((await nao.call("runs", {"most": 1}))["runs"]) == 1
        for wrong in ({"robot": "other"}, {"most": 0}, {"most": 10**6}):
            with pytest.raises(HopError):
                await nao.call("runs", wrong)

    cloud.run(ask)


def test_the_audit_log_has_each_run_once(cloud: CloudProcess) -> None:
    deadline = time.monotonic() + PATIENCE
    ran: list[str] = []
    with open_memory(cloud.data) as memory:
        while "r-3" not in ran:  # it is written behind
            assert time.monotonic() < deadline
            time.sleep(0.05)
            ran = [entry.detail["run"] for entry in memory.audit.entries() if (entry.who, entry.deed) == ("nao", "run")]
    assert ran == ["r-1", "r-2", "r-3"]


def test_rapp_runs(cloud: CloudProcess, capsys: pytest.CaptureFixture[str]) -> None:
    assert rapp(["runs", "--data", str(cloud.data)]) == 0
    shown = capsys.readouterr().out
    lines = shown.splitlines()
    assert len(lines) == 4
    assert "\x1b" not in shown
    assert shown.count("?[2J") == 1  # told by two states
    assert "voice_mail 1.2.0" in lines[2] and "done" in lines[2] and "12.2 s" in lines[2]
    assert rapp(["runs", "--data", str(cloud.data), "--robot", "nao", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["states"] == DONE["states"]
    assert rapp(["runs", "r-1", "--data", str(cloud.data), "--robot", "nao"]) == 0
    assert "      0.75 s  dynamic  s31              for 1.50 s" in capsys.readouterr().out.splitlines()
    assert rapp(["runs", "nothing", "--data", str(cloud.data)]) == 1


@pytest.fixture(scope="module")
def page(cloud: CloudProcess, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chrome]:
    with browser(tmp_path_factory.mktemp("browser")) as driver:
        driver.get(f"http://127.0.0.1:{cloud.port}/runs")
        yield driver


def _enter(page: Chrome, token: str, robot: str = "") -> str:
    for name, text in (("token", token), ("robot", robot)):
        field = page.find_element(By.ID, name)
        field.clear()
        field.send_keys(text)
    said = page.find_element(By.ID, "said")
    page.execute_script("arguments[0].textContent = ''", said)
    page.find_element(By.CSS_SELECTOR, "#enter button").click()
    WebDriverWait(page, PATIENCE, poll_frequency=0.05).until(lambda _: said.text)
    return said.text


def test_the_page_shows_all_runs_to_who_may_see_them(page: Chrome, reader: str) -> None:
    assert _enter(page, reader) == "4 runs"
    runs = page.find_elements(By.TAG_NAME, "details")
    assert [run.get_attribute("data-run") for run in runs] == ["r-1", "r-1", "r-3", "r-2"]
    assert runs[1].find_element(By.TAG_NAME, "summary").text.startswith("voice_mail 1.2.0 done, 12.25 s, nao, ")
    runs[1].find_element(By.TAG_NAME, "summary").click()
    rows = [row.text for row in runs[1].find_elements(By.TAG_NAME, "tr")]
    assert rows == ["at state for", "0.50 s core s9 11.00 s", "0.75 s dynamic s31 1.50 s"]
    assert "failed" in str(runs[3].get_attribute("class"))
    assert _enter(page, reader, "other") == "1 runs"


def test_h20_what_robots_tell_is_text(page: Chrome, reader: str) -> None:
    _enter(page, reader)
    failed = page.find_elements(By.TAG_NAME, "details")[3]
    failed.find_element(By.TAG_NAME, "summary").click()
    assert EVIL in failed.text
    assert page.title == "Runs"
    assert not [entry for entry in page.get_log("browser") if "Content Security Policy" in entry["message"]]
    assert page.find_elements(By.CSS_SELECTOR, "#runs img, #runs script") == []


def test_a_robot_s_token_shows_its_own_and_a_wrong_one_nothing(page: Chrome, cloud: CloudProcess) -> None:
    token = (cloud.data / "robots" / "nao.token").read_text()
    assert _enter(page, token) == "3 runs"
    assert "another robot's" in _enter(page, token, "other")
    assert "cannot serve this caller" in _enter(page, "x" * 43)
    assert page.find_elements(By.TAG_NAME, "details") == []
