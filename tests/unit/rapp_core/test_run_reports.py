"""Reports of runs: what is in them, and that none is lost or sent twice."""

import json
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.link import FakeLink
from rapp_core.control import run_reports
from rapp_core.control.run_reports import FOLDER, KEPT, RunReports
from rapp_core.control.stopping import BY_PERSON
from rapp_core.errors import Invalid, Refused
from rapp_core.trace import Happening, Trace

PATIENCE = 20.0  # s


class Dynamic:
    """A run without a process."""

    name, manifest = "r-1", None
    outcome: tuple[str, str] | None = ("done", "")


class Agents:
    """Gives it, or fails."""

    def __init__(self) -> None:
        self.run = Dynamic()
        self.error: Invalid | None = None

    def activate(self, package: Path, told: Any) -> Any:
        if self.error:
            raise self.error
        return self.run

    def prepare(self) -> None:
        pass

    def log_of(self, manifest: Any) -> Path:
        return Path()


class Bench:
    def __init__(self, home: Path, link: FakeLink | None = None) -> None:
        self.home, self.link, self.agents, self.clock = home, link or FakeLink(), Agents(), [100.0]
        self.link.answers.setdefault("report", {"kept": True})
        self.reports = RunReports(self.agents, self.link, home, "1.0", lambda: self.clock[0])  # type: ignore[arg-type]
        self.trace = Trace()
        self.reports.start(self.trace)

    def enter(self, agent: str, state: str, seconds: float = 1.0) -> None:
        self.trace.tell(Happening(agent, agent, state, "entered", ""))
        self.clock[0] += seconds

    def run(self) -> None:
        self.reports.activate(self.home / "rapps" / "hello" / "1.0.0", lambda _message: None)
        for agent, state in (("core", "s8"), ("dynamic", "s2"), ("core", "s9"), ("dynamic", "s3"), ("core", "s10"), ("core", "s3")):
            self.enter(agent, state)

    def sent(self, count: int) -> list[dict[str, Any]]:
        self.until(lambda: len(self.taken()) >= count)
        return self.taken()

    def taken(self) -> list[dict[str, Any]]:
        return [arguments["run"] for name, arguments in list(self.link.asked) if name == "report"]

    def until(self, true: Callable[[], object]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not true():
            assert time.monotonic() < deadline
            time.sleep(0.01)


def test_a_run_is_reported_with_its_states_and_times(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.run()
    (report,) = bench.sent(1)
    bench.reports.close()
    assert {key: report[key] for key in ("run", "rapp", "version", "outcome", "errors", "versions")} == {
        "run": "r-1", "rapp": "hello", "version": "1.0.0", "outcome": "done", "errors": [], "versions": {"api": "1.0"},
    }  # fmt: skip
    walked = [(entry["agent"], entry["state"], entry["at"], entry["seconds"]) for entry in report["states"]]
    assert walked == [
        ("core", "s8", 0.0, 2.0), ("dynamic", "s2", 1.0, 2.0), ("core", "s9", 2.0, 2.0), ("dynamic", "s3", 3.0, 2.0),
        ("core", "s10", 4.0, 1.0),
    ]  # fmt: skip
    assert report["seconds"] == 5.0
    bench.until(lambda: list((tmp_path / FOLDER).iterdir()) == [])


def test_what_failed_is_in_it(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.agents.run.outcome = ("failed", "ValueError: no")
    bench.reports.activate(tmp_path / "rapps" / "hello" / "1.0.0", lambda _message: None)
    bench.trace.tell(Happening("dynamic", "dynamic", "s3", "failed", "ValueError"))
    bench.trace.tell(Happening("core", "core", "s11", "said", "It has failed"))
    bench.enter("core", "s3")
    (report,) = bench.sent(1)
    bench.reports.close()
    assert report["outcome"] == "failed"
    assert [error["detail"] for error in report["errors"]] == ["ValueError", "It has failed", "ValueError: no"]


def test_what_the_person_has_stopped_has_not_failed(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.agents.run.outcome = ("failed", "Refused: cannot say: its lease has ended")
    bench.reports.activate(tmp_path / "rapps" / "hello" / "1.0.0", lambda _message: None)
    bench.trace.tell(Happening("dynamic", "dynamic", "s3", "failed", "an error before"))
    bench.trace.note(BY_PERSON)
    bench.trace.tell(Happening("dynamic", "dynamic", "s3", "failed", "Refused"))
    bench.trace.tell(Happening("core", "core", "s11", "said", "You have stopped it"))
    bench.enter("core", "s3")
    (report,) = bench.sent(1)
    bench.reports.close()
    assert report["outcome"] == "stopped"
    assert [error["detail"] for error in report["errors"]] == ["an error before"]


def test_one_that_could_not_start_is_reported_too(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.agents.error = Invalid("cannot start it: no entry")
    with pytest.raises(Invalid):
        bench.reports.activate(tmp_path / "rapps" / "hello" / "1.0.0", lambda _message: None)
    bench.enter("core", "s3")
    (report,) = bench.sent(1)
    bench.reports.close()
    assert (report["rapp"], report["outcome"]) == ("hello", "failed")
    assert report["errors"][0]["detail"] == "cannot start it: no entry"


def test_listening_without_a_run_reports_nothing(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    for state in ("s3", "s4", "s11", "s3"):
        bench.enter("core", state)
    bench.reports.close()
    assert bench.link.asked == []
    assert not (tmp_path / FOLDER).exists()


def test_a_link_that_is_away_gets_it_later_and_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_reports, "AGAIN", 0.02)
    bench = Bench(tmp_path)
    bench.link.away = True
    bench.run()
    tries = len(bench.sent(3))
    bench.link.away = False
    bench.until(lambda: list((tmp_path / FOLDER).iterdir()) == [])
    assert len(bench.taken()) > tries - 1
    after = len(bench.taken())
    bench.enter("core", "s3")
    bench.reports.close()
    assert len(bench.taken()) == after


def test_the_next_process_sends_what_is_left(tmp_path: Path) -> None:
    link = FakeLink()
    link.away = True
    first = Bench(tmp_path, link)
    first.reports.activate(tmp_path / "rapps" / "hello" / "1.0.0", lambda _message: None)
    first.agents.run.outcome = None
    first.reports.close()
    assert len(list((tmp_path / FOLDER).glob("*.json"))) == 1
    second = Bench(tmp_path)
    (report,) = second.sent(1)
    second.reports.close()
    assert (report["run"], report["outcome"]) == ("r-1", "failed")


def test_one_that_is_refused_does_not_block_the_others(tmp_path: Path) -> None:
    (tmp_path / FOLDER).mkdir()
    (tmp_path / FOLDER / "1-x.json").write_text("no JSON")
    (tmp_path / FOLDER / "2-y.json").write_text(json.dumps({"run": "y"}))
    link = FakeLink()
    link.errors["report"] = Refused("cannot keep it")
    bench = Bench(tmp_path, link)
    bench.until(lambda: list((tmp_path / FOLDER).iterdir()) == [])
    bench.reports.close()
    assert len(bench.taken()) == 1
    assert threading.active_count() < 10


def test_they_are_bounded(tmp_path: Path) -> None:
    link = FakeLink()
    link.away = True
    bench = Bench(tmp_path, link)
    for _ in range(KEPT + 3):
        bench.run()
    bench.reports.close()
    assert len(list((tmp_path / FOLDER).glob("*.json"))) == KEPT


def test_a_run_that_walks_for_ever_is_bounded(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.reports.activate(tmp_path / "rapps" / "hello" / "1.0.0", lambda _message: None)
    for number in range(5000):
        bench.enter("dynamic", f"s{number}")
        bench.trace.tell(Happening("dynamic", "dynamic", "x", "failed", "y" * 5000))
    bench.enter("core", "s3")
    (report,) = bench.sent(1)
    bench.reports.close()
    assert len(json.dumps(report)) < 200_000
