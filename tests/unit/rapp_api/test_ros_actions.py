"""The action client for RApps: an end that comes at once is not lost."""

import threading
from types import SimpleNamespace
from typing import Any

import pytest
from actionlib import CommState, SimpleActionClient, SimpleGoalState

from rapp_api.ros_actions import ActionClient


class QuickServer:
    """Stands for actionlib's inner client: the goal has ended, in another thread, before `send_goal` returns."""

    ns = "quick"

    def __init__(self) -> None:
        self.told = threading.Thread()

    def send_goal(self, _goal: Any, transition: Any, _feedback: Any) -> Any:
        handle = SimpleNamespace(
            get_comm_state=lambda: CommState.DONE, get_goal_status=lambda: 4, get_result=lambda: "refused", comm_state_machine=None
        )
        self.told = threading.Thread(target=transition, args=(handle,))
        self.told.start()
        self.told.join(0.2)  # as long as a goal that ends at once would take
        return handle


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Any:
    def begin(self: Any, _name: str, _action: Any) -> None:
        self.action_client, self.gh = QuickServer(), None
        self.simple_state, self.done_condition = SimpleGoalState.DONE, threading.Condition()

    monkeypatch.setattr(SimpleActionClient, "__init__", begin)
    monkeypatch.setattr("rapp_api.ros_actions._announce", lambda *_words: None)
    return ActionClient("rapp_move_joint", {})


def test_the_end_of_a_goal_that_comes_at_once_is_not_lost(client: Any) -> None:
    ends: list[Any] = []
    client.send_goal("goal", lambda status, result: ends.append((status, result)))
    client.action_client.told.join(10)
    assert ends == [(4, "refused")]
    assert client.simple_state == SimpleGoalState.DONE
