"""The runner as a real process in a real ROS, told what to be over a real channel."""

import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rapp_cli.paths import STORE

Start = Callable[[], Any]


def states(runner: Any) -> list[tuple[str, str]]:
    return [(m["kind"], m["state"]) for m in runner.seen if m["type"] == "state"]


def beats(runner: Any) -> list[int]:
    return [m["count"] for m in runner.seen if m["type"] == "heartbeat"]


def test_a_rapp_lives_from_activation_to_gone(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    runner.activate(rapp("communication.rapp_say('hello')\nassert communication.rapp_recognize(['a', 'b']) == 'b'"), core.secret)
    assert runner.until("first_word")["name"] == "Agent"
    assert runner.until("terminate") == {"type": "terminate", "outcome": "done", "detail": ""}
    runner.send(type="dismantle")
    runner.until("gone")
    assert runner.wait() == 0
    assert [state for kind, state in states(runner) if kind == "entered"] == ["s1", "s2", "s3", "execute", "s4", "s5"]
    first_word = next(i for i, m in enumerate(runner.seen) if m["type"] == "first_word")
    assert runner.seen[first_word - 1]["state"] == "s1"
    assert beats(runner) == sorted(beats(runner))
    calls = core.calls()
    assert [(call["service"], call.get("text")) for call in calls] == [("rapp_say", "hello"), ("rapp_recognize", None)]
    assert calls[0]["caller"].startswith("/dynamic_agent_"), "a neutral name, with something to tell runs apart"


def test_voice_mail_runs_in_a_process_of_its_own(spare: Start, core: Any, tmp_path: Path) -> None:
    """The profile here is no profile: the RApp fails in s2, and says so in the form the core agent understands."""
    runner = spare()
    runner.activate(STORE / "voice_mail", core.secret)
    assert runner.until("terminate")["outcome"] == "failed"
    assert ("failed", "s2") in states(runner)
    assert runner.seen[-1]["detail"].startswith("KeyError")


def test_a_rapp_with_another_s_secret_is_refused(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    runner.activate(rapp("communication.rapp_say('hello')"), "guessed")
    end = runner.until("terminate")
    assert end["outcome"] == "failed"
    assert end["detail"].startswith("Refused: cannot serve this call")


def test_error_words_become_exceptions(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    body = """
from rapp_api import errors
import pytest
with pytest.raises(errors.Refused, match="forbidden"):
    communication.rapp_say("refuse")
with pytest.raises(errors.Unreachable, match="try later"):
    cloud.call_wait("away")
with pytest.raises(errors.Invalid):
    communication.rapp_say(5)
with pytest.raises(errors.Invalid):
    cloud.call_wait("x", {"x": object()})
with pytest.raises(errors.Unreachable, match="rapp_play_audio"):
    communication.play_audio("x.ogg")  # nobody serves it here
communication.rapp_say("still here")
"""
    runner.activate(rapp(body.strip()), core.secret)
    assert runner.until("terminate")["detail"] == ""
    assert core.calls()[-1]["text"] == "still here"


def test_calls_at_the_same_time_do_not_disturb_each_other(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    body = """
import queue
answers = queue.Queue()
for number in range(6):
    cloud.call("quick" if number % 2 else "slow", {"number": number}, answers.put, answers.put, timeout=3.0)
communication.rapp_say("meanwhile")
got = [answers.get(timeout=20) for _ in range(6)]
assert sorted(answer["echo"]["number"] for answer in got) == list(range(6)), got
assert all(answer["timeout"] == 3.0 for answer in got), got
"""
    runner.activate(rapp(body.strip()), core.secret)
    assert runner.until("terminate")["detail"] == ""


def test_mail_and_recording_come_back_as_the_core_agent_says(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    body = "path = communication.rapp_record(2.5)\nassert cloud.send_mail_wait(['a@b.example'], 's', 'b', path) == 'kept'"
    runner.activate(rapp(body), core.secret)
    assert runner.until("terminate")["detail"] == ""
    record, mail = core.calls()
    assert record["duration"] == 2.5
    fields = {name: mail[name] for name in ("recipients", "subject", "body", "attachment")}
    assert fields == {"recipients": ["a@b.example"], "subject": "s", "body": "b", "attachment": "/recordings/1.ogg"}


def test_a_connection_lost_while_idle_is_made_anew_and_nothing_is_asked_twice(
    spare: Start, core: Any, rapp: Callable[[str], Path]
) -> None:
    runner = spare()
    body = """
import socket
from rapp_api.core_agent import current
communication.rapp_say("one")
for proxy in current()._idle["rapp_say"]:
    proxy.transport.socket.shutdown(socket.SHUT_RDWR)
communication.rapp_say("two")
"""
    runner.activate(rapp(body.strip()), core.secret)
    assert runner.until("terminate")["detail"] == ""
    assert [call["text"] for call in core.calls()] == ["one", "two"]


def test_an_answer_that_does_not_come_is_not_awaited_for_ever(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    body = """
from rapp_api import errors
from rapp_api.ros_core_agent import RosCoreAgent
import pytest
with pytest.raises(errors.Unreachable):
    RosCoreAgent(self.parameters["token"], answer_timeout=0.3).say("wait 3", "en")
"""
    runner.activate(rapp(body.strip()), core.secret, token=core.secret)
    assert runner.until("terminate")["detail"] == ""


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("raise ValueError('boom')", "ValueError: boom"),
        ("import sys\nsys.exit(0)", "SystemExit: 0"),
        ("raise ValueError('x' * 200_000)", "ValueError: xxx"),
        ("import nonsense_that_is_not_there", "ModuleNotFoundError"),
    ],
)
def test_a_rapp_that_fails_says_why(spare: Start, core: Any, rapp: Callable[[str], Path], body: str, says: str) -> None:
    runner = spare()
    runner.activate(rapp(body), core.secret)
    end = runner.until("terminate")
    assert end["outcome"] == "failed"
    assert end["detail"].startswith(says)
    runner.send(type="dismantle")
    runner.until("gone")
    assert runner.wait() == 0


def test_a_file_that_is_no_rapp_is_reported(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    package = rapp("pass")
    (package / "agent.py").write_text("this is no python")
    runner.activate(package, core.secret)
    assert runner.until("terminate")["detail"].startswith("SyntaxError")


def test_the_heartbeat_stands_still_while_the_rapp_hangs(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    """Even with a thread of the RApp's own that goes on calling the core agent."""
    runner = spare()
    body = """
import threading, time
def chatter():
    while True:
        communication.rapp_say("chatter")
        time.sleep(0.05)
threading.Thread(target=chatter, daemon=True).start()
communication.rapp_say("now I hang")
time.sleep(60)
"""
    runner.activate(rapp(body.strip()), core.secret)
    runner.until("state", lambda m: m["state"] == "execute")
    while [call["text"] for call in core.calls()].count("chatter") < 5:
        runner.until("heartbeat")
    still = [runner.until("heartbeat")["count"] for _ in range(4)]
    assert len(set(still)) == 1


def test_a_rapp_that_pauses_is_not_taken_for_hung(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    runner.activate(rapp("self.pause(60)"), core.secret)
    runner.until("state", lambda m: m["state"] == "execute")
    counts = [runner.until("heartbeat")["count"] for _ in range(4)]
    assert counts[-1] > counts[0]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("body", [None, "import time\ntime.sleep(60)", "communication.rapp_say('wait 60')"])
def test_a_signal_ends_it(spare: Start, core: Any, rapp: Callable[[str], Path], body: str | None, number: signal.Signals) -> None:
    runner = spare()
    if body is not None:
        runner.activate(rapp(body), core.secret)
        runner.until("state", lambda m: m["state"] == "execute")
    runner.process.send_signal(number)
    assert runner.wait() == 0


def test_it_ends_when_the_core_agent_is_gone(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    warm, busy = spare(), spare()
    warm.hang_up()
    assert warm.wait() == 0
    busy.activate(rapp("import time\ntime.sleep(60)"), core.secret)
    busy.until("first_word")
    busy.hang_up()
    assert busy.wait() == 1


def test_a_thread_the_rapp_leaves_does_not_keep_the_process(spare: Start, core: Any, rapp: Callable[[str], Path]) -> None:
    runner = spare()
    runner.activate(rapp("import threading, time\nthreading.Thread(target=time.sleep, args=(60,)).start()"), core.secret)
    runner.until("terminate")
    runner.send(type="dismantle")
    runner.until("gone")
    assert runner.wait() == 0


def test_it_leaves_no_trace_at_the_ros_master(spare: Start, ros_env: dict[str, str]) -> None:
    def nodes() -> set[str]:
        script = "import rosgraph; print(rosgraph.Master('/test').getSystemState())"
        done = subprocess.run([sys.executable, "-c", script], env=ros_env, capture_output=True, text=True, check=True)
        return set(re.findall(r"dynamic_agent\w*", done.stdout))

    before = nodes()
    runner = spare()
    assert len(nodes() - before) == 1
    runner.process.terminate()
    runner.wait()
    assert nodes() <= before
