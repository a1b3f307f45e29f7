"""hazard_detection end to end: real processes, a robot that walks in the simulated room, a confined cloud agent on the platform."""

import email
import json
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from email.policy import default
from pathlib import Path

import pytest

from fakes.whole_robot import processes_of
from rapp_cli.paths import ROOT

pytestmark = [pytest.mark.system, pytest.mark.timeout(420)]
TIMEOUT = 400  # s of one run
WISHES = {
    "open": ("--door", "40", "--light", "on", "--mail"),
    "safe": ("--door", "0", "--light", "off", "--start", "window"),
}
BOTH = pytest.mark.parametrize("name", list(WISHES))


@dataclass(frozen=True)
class Look:
    """A finished run of the demo."""

    status: int
    output: str
    folder: Path

    @property
    def entries(self) -> list[dict[str, str]]:
        return [json.loads(line) for line in (self.folder / "timeline.jsonl").read_text().splitlines()]

    @property
    def said(self) -> list[str]:
        return [e["detail"] for e in self.entries if e["kind"] == "said" and e["agent"] != "person"]

    @property
    def messages(self) -> list[str]:
        return [e["detail"] for e in self.entries if e["kind"] == "message"]


def run(folder: Path, *options: str) -> Look:
    words = [str(ROOT / "rapp"), "demo", "hazard", "--silent", "--timeout", str(TIMEOUT - 30), "--folder", str(folder), *options]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT, check=False)
    return Look(done.returncode, done.stdout, folder)


@pytest.fixture(scope="module")
def looks(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Look]]:
    with ThreadPoolExecutor() as pool:
        runs = {name: pool.submit(run, tmp_path_factory.mktemp(name), *options) for name, options in WISHES.items()}
        yield {name: look.result() for name, look in runs.items()}


@BOTH
def test_what_it_says_is_so(looks: dict[str, Look], name: str) -> None:
    look = looks[name]
    assert look.status == 0, look.output
    answer = {
        "open": "the door is open by about 40 degrees, and the lamp is on; please see to it",
        "safe": "everything is safe, the door is closed, and the lamp is off",
    }
    assert answer[name] in look.said


def test_a_mail_goes_to_the_carer_if_asked(looks: dict[str, Look]) -> None:
    assert looks["open"].said[-1] == "I have written to Elizabeth"
    (mail,) = (looks["open"].folder / "mail").glob("**/new/*")
    body = email.message_from_bytes(mail.read_bytes(), policy=default).get_body()
    assert body is not None
    assert "the door is open by about 40 degrees, and the lamp is on" in body.get_content()
    assert list((looks["safe"].folder / "mail").glob("**/new/*")) == []


@BOTH
def test_it_walks_to_both_places_and_its_cloud_agent_judges_its_pictures(looks: dict[str, Look], name: str) -> None:
    look = looks[name]
    assert [text for text in look.said if text.startswith("I go to")][:2] == ["I go to the door", "I go to the lamp"]
    kept = look.folder / "robot" / "keepsakes" / "hazard_detection"
    assert sorted(path.name for path in kept.iterdir()) == ["door.jpg", "lamp.jpg"]
    for wanted in ("core->link start_cloud_agent", "dynamic->core rapp_cloud_call", "dynamic->core rapp_stop_cloud_agent"):
        assert any(wanted in message for message in look.messages), wanted


@BOTH
def test_nothing_is_left_running(looks: dict[str, Look], name: str) -> None:
    states = [e["state"] for e in looks[name].entries if e["kind"] == "entered" and "/" not in e["state"]]
    assert states[-1] == "s3"
    assert "s11" not in states
    assert processes_of(looks[name].folder) == []
