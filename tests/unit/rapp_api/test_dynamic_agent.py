"""The skeleton of Fig. 3: s1 to s5 in order, whatever the author's part does."""

from collections.abc import Callable

import pytest

from rapp_agent import Event
from rapp_api import Behaviour, DynamicAgent, Edge, Machine


class Probe(DynamicAgent):
    """Notes what it is asked to do; `fails` names the part that raises."""

    def __init__(self, fails: str = "") -> None:
        super().__init__({})
        self.done: list[str] = []
        self._fails = fails

    def _do(self, part: str) -> None:
        self.done.append(part)
        if part == self._fails:
            raise ValueError(part)

    def initialise(self) -> None:
        self._do("initialise")

    def execute(self) -> None:
        self._do("execute")

    def terminate(self) -> None:
        self._do("terminate")


def walk(agent: DynamicAgent, send: Callable[[Exception | None], None]) -> list[str]:
    states: list[str] = []

    def note(event: Event) -> None:
        if event.kind == "entered" and event.machine == "dynamic":
            states.append(event.state)

    agent.run(send_terminate=send, on_event=note, wait=lambda _seconds: None)
    return states


def test_it_walks_s1_to_s5() -> None:
    agent = Probe()
    sent: list[Exception | None] = []
    assert walk(agent, sent.append) == ["s1", "s2", "s3", "s4", "s5"]
    assert (agent.done, sent) == (["initialise", "execute", "terminate"], [None])


@pytest.mark.parametrize(
    ("fails", "done"), [("initialise", ["initialise", "terminate"]), ("execute", ["initialise", "execute", "terminate"])]
)
def test_an_error_leads_to_s4_and_is_reported_by_s5(fails: str, done: list[str]) -> None:
    agent = Probe(fails)
    sent: list[Exception | None] = []
    assert walk(agent, sent.append)[-2:] == ["s4", "s5"]
    assert agent.done == done
    assert [str(error) for error in sent] == [fails]


def test_a_failure_to_report_is_not_reported_for_ever() -> None:
    def send(_error: Exception | None) -> None:
        raise OSError("the channel is gone")

    with pytest.raises(OSError, match="gone"):
        walk(Probe(), send)


def test_without_anyone_to_tell_an_error_is_raised() -> None:
    with pytest.raises(ValueError, match="execute"):
        Probe("execute").run()


def test_a_task_is_stepped_with_pauses_until_its_conditions_hold() -> None:
    waits: list[float] = []

    counted: list[int] = []

    class Counting(DynamicAgent):
        def task(self) -> Machine:
            count = Behaviour("count", lambda _share: counted.append(1), lambda _share: len(counted) == 3)
            states = {"count": count, "end": Behaviour("end", lambda _share: None)}
            return Machine("counting", states, "count", [Edge("count", "end")], ["end"])

    Counting().run(wait=waits.append)
    assert len(counted) == 3
    assert 1 <= len(waits) < 3
