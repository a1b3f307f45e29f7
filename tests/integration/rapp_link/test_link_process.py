"""The link as a process: a real ROS master, the bridge, the mail server, and a rospy node that plays the core's part."""

import email
import json
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from email.message import EmailMessage
from email.policy import default
from pathlib import Path
from typing import Any

import pytest

from fakes.told_node import told_node

NODE = """
import json, sys, time, rospy
from rapp_msgs.msg import HopEvent
from rapp_msgs.srv import HopRequest
from std_msgs.msg import String
rospy.init_node("asker", disable_signals=True)
def write(**fields): sys.__stdout__.write(json.dumps(fields) + "\\n"); sys.__stdout__.flush()
alive_at = [0.0, ""]
def heard(message): alive_at[:] = [time.monotonic(), message.data]
def event(e): write(job=e.job, kind=e.kind, phase=e.phase, error=e.error, message=e.message, result=e.result)
rospy.Subscriber("rapp_hop/alive", String, heard)
events = rospy.Subscriber("rapp_hop/events", HopEvent, event, queue_size=1000)
cancel = rospy.Publisher("rapp_hop/cancel", String, queue_size=10)
write(ready=True)
for line in sys.stdin:
    what, *rest = json.loads(line)
    if what == "ask":
        name, job, arguments, timeout = rest
        try:
            rospy.wait_for_service("rapp_hop/" + name, 10)
            answer = rospy.ServiceProxy("rapp_hop/" + name, HopRequest)(job, arguments, timeout)
            write(asked=job, accepted=answer.accepted, message=answer.message)
        except (rospy.ServiceException, rospy.ROSException) as error: write(asked=job, accepted=False, message=str(error))
    elif what == "cancel": cancel.publish(rest[0])
    elif what == "alive": write(age=time.monotonic() - alive_at[0], sign=alive_at[1], events=events.get_num_connections())
"""


class Asker:
    """A rospy node that asks the link as the core does."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self._early: list[dict[str, Any]] = []
        self.read("ready")

    def write(self, *words: Any) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(words) + "\n")
        self._process.stdin.flush()

    def read(self, field: str) -> dict[str, Any]:
        """The next line that has the field; others are kept for later."""
        assert self._process.stdout is not None
        for line in self._early:
            if field in line:
                self._early.remove(line)
                return line
        while True:
            text = self._process.stdout.readline()
            assert text, "the asking node has ended"
            line = json.loads(text)
            if field in line:
                return dict(line)
            self._early.append(line)

    def ask(self, service: str, job: str, arguments: dict[str, Any] | str, timeout: float = 20) -> dict[str, Any]:
        text = arguments if isinstance(arguments, str) else json.dumps(arguments)
        self.write("ask", service, job, text, timeout)
        return self.read("asked")

    def outcome(self) -> dict[str, Any]:
        while (event := self.read("job"))["kind"] in (0, 3):  # progress, messages
            continue
        return event

    def do(self, service: str, job: str, arguments: dict[str, Any], timeout: float = 20) -> dict[str, Any]:
        answer = self.ask(service, job, arguments, timeout)
        assert answer["accepted"], answer
        event = self.outcome()
        assert event["job"] == job
        return event

    def alive(self) -> dict[str, Any]:
        self.write("alive")
        return self.read("age")

    def wait_alive(self, boot: str) -> None:
        deadline = time.monotonic() + 15
        while time.monotonic() < deadline:
            state = self.alive()
            if state["sign"] and json.loads(state["sign"])["boot"] == boot and state["age"] < 0.9 and state["events"]:
                return
            time.sleep(0.05)
        raise AssertionError("no sign of life of the link")


@pytest.fixture
def asker(ros_env: dict[str, str]) -> Iterator[Asker]:
    with told_node(ros_env, NODE) as process:
        yield Asker(process)


def mail_arguments(home: Path, message_id: str) -> dict[str, Any]:
    recording = home / "runs" / "r1" / "recordings" / "message.ogg"
    recording.parent.mkdir(parents=True, exist_ok=True)
    recording.write_bytes(b"OggS" + bytes(range(256)))
    return {
        "recipients": ["Zofia Żak <zofia@home.example>"], "subject": "Wiadomość głosowa", "body": "Proszę posłuchać.",
        "attachment": str(recording), "message_id": message_id,
    }  # fmt: skip


def delivered(maildir: Path) -> list[EmailMessage]:
    files = sorted((maildir / "new").iterdir())
    messages = [email.message_from_bytes(path.read_bytes(), policy=default) for path in files]
    return [message for message in messages if isinstance(message, EmailMessage)]


Start = Callable[..., Any]


def start_link(start: Start, home: Path, bridge: int, mail: int, cloud: str = "http://127.0.0.1:9") -> Any:
    words = ["--bridge", f"ws://127.0.0.1:{bridge}", "--home", str(home), "--cloud", cloud]
    words += ["--smtp-host", "127.0.0.1", "--smtp-port", str(mail), "--smtp-security", "none"]
    words += ["--mail-from", "nao@home.example"]
    return start("rapp_link", *words)


def test_a_mail_asked_for_by_ros_arrives_and_the_caller_sees_it(start: Start, asker: Asker, tmp_path: Path) -> None:
    home, maildir = tmp_path / "home", tmp_path / "mail"
    bridge = start("rapp_bridge", "--port", "0").ready["port"]
    mail = start("rapp_cloud.mail", "--port", "0", "--maildir", str(maildir)).ready["port"]
    link = start_link(start, home, bridge, mail)
    asker.wait_alive(link.ready["boot"])

    arguments = mail_arguments(home, "<m1@nao.home.example>")
    event = asker.do("send_mail", "j1", arguments)
    assert (event["kind"], json.loads(event["result"])) == (1, {"state": "delivered", "message_id": "<m1@nao.home.example>"})
    again = asker.do("send_mail", "j2", arguments)
    assert json.loads(again["result"])["state"] == "delivered"

    (message,) = delivered(maildir)
    (part,) = message.iter_attachments()
    assert (part.get_content_type(), part.get_filename()) == ("audio/ogg", "message.ogg")
    assert part.get_content() == b"OggS" + bytes(range(256))
    assert message["Subject"] == "Wiadomość głosowa"
    assert message["To"].addresses[0].display_name == "Zofia Żak"


def test_requests_that_cannot_be_done_are_answered_with_the_reason(start: Start, asker: Asker, tmp_path: Path) -> None:
    home = tmp_path / "home"
    bridge = start("rapp_bridge", "--port", "0").ready["port"]
    link = start_link(start, home, bridge, 9)
    asker.wait_alive(link.ready["boot"])

    assert "nested" in asker.ask("report", "deep", "[" * 100_000)["message"]
    assert not asker.ask("report", "list", "[]")["accepted"]
    assert not asker.ask("report", "", {"run": {}})["accepted"]
    foreign = asker.do("send_mail", "j1", {**mail_arguments(home, "<a@b>"), "attachment": "/etc/passwd"})
    assert (foreign["kind"], foreign["error"]) == (2, "refused")
    assert "data folder" in foreign["message"]
    assert not asker.ask("send_mail", "j1", {})["accepted"], "an id serves once"
    away = asker.do("call", "j2", {"service": "profile", "arguments": {}})
    assert (away["kind"], away["error"]) == (2, "unreachable")
    untrusting = asker.do("install", "j3", {"name": "voice_mail"})
    assert (untrusting["error"], "--root-file" in untrusting["message"]) == ("refused", True)
    assert json.loads(asker.do("report", "j4", {"run": {"run": "r1"}})["result"]) == {"kept": True}


def test_a_job_ends_at_its_deadline_and_by_cancelling(start: Start, asker: Asker, tmp_path: Path) -> None:
    home = tmp_path / "home"
    bridge = start("rapp_bridge", "--port", "0").ready["port"]
    with socket.create_server(("127.0.0.1", 0)) as listener:  # a platform that takes calls and never answers
        link = start_link(start, home, bridge, 9, f"http://127.0.0.1:{listener.getsockname()[1]}")
        asker.wait_alive(link.ready["boot"])
        late = asker.do("call", "late", {"service": "profile", "arguments": {}}, timeout=0.5)
        assert (late["kind"], late["error"]) == (2, "unreachable")
        assert asker.ask("call", "unwanted", {"service": "profile", "arguments": {}}, timeout=60)["accepted"]
        asker.write("cancel", "unwanted")
        event = asker.outcome()
        assert (event["job"], event["error"], "cancelled" in event["message"]) == ("unwanted", "refused", True)
        assert asker.alive()["age"] < 0.9


def test_the_link_killed_is_silent_and_comes_back_with_a_mail_it_had_kept(start: Start, asker: Asker, tmp_path: Path) -> None:
    home, maildir = tmp_path / "home", tmp_path / "mail"
    bridge = start("rapp_bridge", "--port", "0").ready["port"]
    mail = start("rapp_cloud.mail", "--port", "0", "--maildir", str(maildir))
    port = mail.ready["port"]
    mail.stop()
    link = start_link(start, home, bridge, port)
    asker.wait_alive(link.ready["boot"])
    event = asker.do("send_mail", "j1", mail_arguments(home, "<k1@nao.home.example>"))
    assert json.loads(event["result"])["state"] == "kept"

    link.process.send_signal(signal.SIGKILL)
    link.process.wait(5)
    time.sleep(1.0)
    assert asker.alive()["age"] > 0.9

    start("rapp_cloud.mail", "--port", str(port), "--maildir", str(maildir))
    second = start_link(start, home, bridge, port)
    asker.wait_alive(second.ready["boot"])
    deadline = time.monotonic() + 15
    while not delivered(maildir) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert [message["Message-ID"] for message in delivered(maildir)] == ["<k1@nao.home.example>"]
    assert second.stop() == 0


def test_a_bridge_that_comes_later_and_again_is_joined_once(start: Start, asker: Asker, tmp_path: Path) -> None:
    home = tmp_path / "home"
    first = start("rapp_bridge", "--port", "0")
    port = first.ready["port"]
    first.stop()
    link = start_link(start, home, port, 9)
    for number in range(2):
        bridge = start("rapp_bridge", "--port", str(port))
        asker.wait_alive(link.ready["boot"])
        assert asker.do("report", f"j{number}", {"run": {"run": f"r{number}"}})["kind"] == 1
        bridge.stop()
    assert link.stop() == 0
    assert not [line for line in asker._early if "job" in line], "an event came twice"
