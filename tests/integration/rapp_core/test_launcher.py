"""Lives and deaths of dynamic agents: real processes in real sandboxes."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from fakes.processes import ended
from fakes.rapps import write_rapp
from rapp_core.errors import Invalid, Refused
from rapp_core.launcher import orphans
from rapp_core.launcher.channel import LONGEST, Channel
from rapp_core.launcher.launcher import Launcher
from rapp_core.launcher.run import Run
from rapp_core.ros.services import offered

FOREVER = "import time\nwhile True: time.sleep(0.05)"


def namespace(pid: int) -> Path | None:
    try:
        return Path(f"/proc/{pid}/ns/pid").readlink()
    except OSError:
        return None


def inside_of(run: Run) -> list[int]:
    """All processes of a run's sandbox."""
    own = namespace(run._process.first)
    return [pid for pid in (int(each.name) for each in Path("/proc").glob("[0-9]*")) if namespace(pid) == own]


def test_a_run_from_first_word_to_gone(workshop):
    text, outcome = workshop.finish(workshop.start("print('hello from inside')"))
    assert "hello from inside" in text
    assert outcome == "done"
    kinds = [message["type"] for message in workshop.heard if message["type"] != "state"]
    assert kinds == ["activate", "first_word", "terminate", "gone"]
    states = [m["state"] for m in workshop.heard if m["type"] == "state" and m["kind"] == "entered" and m["machine"] == "dynamic"]
    assert states == ["s1", "s2", "s3", "s4", "s5"]


def test_an_activation_uses_the_spare_and_only_once(workshop):
    workshop.launcher.prepare()
    spare = workshop.launcher._spare
    assert spare.wait_ready(20)
    run = workshop.start(FOREVER)
    assert run is spare
    workshop.launcher.prepare()
    assert workshop.launcher._spare is not spare
    assert workshop.start(FOREVER) is not spare


def test_a_spare_that_has_died_is_replaced(workshop, wait_for):
    workshop.launcher.prepare()
    dead = workshop.launcher._spare
    assert dead.wait_ready(20)
    os.kill(dead._process.first, signal.SIGKILL)
    wait_for(lambda: not dead.alive)
    assert workshop.finish(workshop.start("pass"))[1] == "done"


def test_what_a_run_leaves_is_removed(workshop):
    run = workshop.start("open('kept', 'w').write('x')")
    assert run.folders.root.exists()
    workshop.finish(run)
    assert not run.folders.root.exists()


def test_a_crash_is_seen_and_leaves_no_process(workshop, wait_for):
    run = workshop.start("import os\nos._exit(7)")
    wait_for(lambda: not run.alive)
    run.end(0.0)
    assert run.status == 7
    assert ended(run._process.first)


def test_an_error_in_the_rapp_is_its_outcome(workshop, wait_for):
    run = workshop.start("raise KeyError('name')")
    wait_for(lambda: run.outcome is not None)
    assert run.outcome == ("failed", "KeyError: 'name'")


@pytest.mark.parametrize("body", ["import nothing_of_this_name", "sys.exit(3)"])
def test_a_program_that_cannot_even_run_has_failed(workshop, wait_for, body):
    run = workshop.start(body)
    wait_for(lambda: run.outcome is not None or not run.alive)
    assert run.outcome is None or run.outcome[0] == "failed"


def test_l04_a_process_that_ignores_sigterm_is_killed_with_all_it_has_started(workshop, wait_for):
    body = """
import os, signal, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        while True: time.sleep(0.05)
    os._exit(0)
open("/rapp/private/started", "w").close()
while True: time.sleep(0.05)
"""
    run = workshop.start(body.strip())
    wait_for(lambda: Path(f"/proc/{run._process.first}/root/rapp/private/started").exists())
    inside = inside_of(run)
    assert len(inside) >= 3  # bubblewrap's first process, the runner, the grandchild
    run.end(0.2)
    assert run.status == -signal.SIGKILL or run.status == 128 + signal.SIGKILL
    wait_for(lambda: all(ended(pid) for pid in inside))


def test_sigterm_reaches_the_program_inside(workshop, wait_for):
    run = workshop.start(FOREVER)
    run.end(5.0)
    assert run.status == 0  # it left by itself: SIGKILL would show


def test_a_loop_that_stands_still_beats_on_but_does_not_count(workshop, wait_for):
    run = workshop.start("import time\nprint('asleep', flush=True)\ntime.sleep(30)")
    wait_for(lambda: "asleep" in run.folders.log.read_text())
    asleep = run.heartbeat
    wait_for(lambda: run.heartbeat > asleep + 0.3)  # this one tells the last count
    progress = run.progress
    wait_for(lambda: run.heartbeat > asleep + 1.0)
    assert run.progress == progress


def test_a_stopped_process_falls_silent(workshop, wait_for):
    run = workshop.start(FOREVER)
    inside = inside_of(run)
    for pid in inside:
        os.kill(pid, signal.SIGSTOP)
    before = run.heartbeat
    threading.Event().wait(0.6)
    assert run.heartbeat - before < 0.3
    run.end(0.1)
    assert all(ended(pid) for pid in inside)


def test_sandboxes_end_when_the_core_agent_is_killed(workshop, tmp_path, wait_for):
    program = f"""
import os, sys, time
from pathlib import Path
from rapp_core.config import Config
from rapp_core.launcher.launcher import Launcher
from rapp_core.launcher.run import Run
from rapp_core.ros.services import offered
launcher = Launcher(Config(home=Path({str(tmp_path / "other")!r})), {workshop.launcher._ros!r}, offered("/core_agent"))
launcher.open()
launcher.prepare()
assert launcher._spare.wait_ready(20)
print(launcher._spare._process.first, launcher._spare._process.pid, launcher._spare._gate.pid, flush=True)
time.sleep(60)
"""
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    pids = [int(word) for word in process.stdout.readline().split()]
    assert len(pids) == 3
    os.kill(pids[2], signal.SIGSTOP)  # even a gate that stands still
    process.kill()
    process.wait()
    process.stdout.close()
    wait_for(lambda: all(ended(pid) for pid in pids))


def test_orphans_are_killed_and_their_folders_removed(tmp_path, wait_for):
    orphan = subprocess.Popen(["sleep", "60"], start_new_session=True)
    folder = tmp_path / "runs" / "old"
    folder.mkdir(parents=True)
    orphans.note(folder, orphan.pid)
    orphans.clear(tmp_path / "runs")
    assert orphan.wait(5) == -signal.SIGKILL
    assert not folder.exists()


def test_l07_a_sandbox_that_was_about_to_start_is_killed(tmp_path, wait_for):
    """Its parent has died in its first moments, before anything was noted; it is known by its folder."""
    folder = tmp_path / "runs" / "old"
    folder.mkdir(parents=True)
    read, write = os.pipe()  # nobody writes: it waits, as one whose parent died does
    words = ["bwrap", "--dev-bind", "/", "/", "--ro-bind", str(folder), f"{folder}/", "--block-fd", str(read), "sleep", "60"]
    waiting = subprocess.Popen(words, pass_fds=[read])
    try:
        wait_for(lambda: "bwrap" in Path(f"/proc/{waiting.pid}/cmdline").read_text())  # empty for a moment after exec
        orphans.clear(tmp_path / "runs")
        assert waiting.wait(20) == -signal.SIGKILL
        assert not folder.exists()
    finally:
        waiting.kill()
        waiting.wait()
        os.close(read)
        os.close(write)


def test_l12_a_process_id_used_again_by_another_is_left_alone(tmp_path):
    other = subprocess.Popen(["sleep", "60"], start_new_session=True)
    try:
        folder = tmp_path / "runs" / "old"
        folder.mkdir(parents=True)
        (folder / orphans.PID_FILE).write_text(f"{other.pid} 1")
        orphans.clear(tmp_path / "runs")
        assert other.poll() is None
        assert not folder.exists()
    finally:
        other.kill()
        other.wait()


def test_one_data_folder_has_one_core_agent(workshop):
    with pytest.raises(Refused, match="--home"):
        Launcher(workshop.config, {}, offered("/core_agent")).open()


@pytest.mark.parametrize("broken", ["{", "[]", json.dumps({"name": "x"}), ""])
def test_a_broken_package_is_refused_before_anything_starts(workshop, tmp_path, broken):
    package = write_rapp(tmp_path / "broken", "broken")
    (package / "package.json").write_text(broken)
    with pytest.raises(Invalid):
        workshop.launcher.activate(package, lambda _message: None)


def test_a_sandbox_that_cannot_start_says_what_to_do(workshop, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(Exception, match="install the Debian package bubblewrap"):
        workshop.start("pass")


# the channel


@pytest.fixture
def ends():
    ours, theirs = socket.socketpair()
    channel = Channel(ours)
    yield channel, theirs
    channel.close()
    theirs.close()


def test_messages_cross_the_channel_one_per_line(ends):
    channel, theirs = ends
    channel.send(type="activate", parameters={"line": "a\nb"})
    assert json.loads(theirs.recv(1000)) == {"type": "activate", "parameters": {"line": "a\nb"}}
    theirs.sendall(b'{"type": "ready"}\n{"type": "heart')
    assert channel.receive() == {"type": "ready"}
    theirs.sendall(b'beat"}\n')
    assert channel.receive() == {"type": "heartbeat"}
    theirs.sendall(b'{"type": "state", "detail": "half of \\ud83d"}\n')
    assert channel.receive() == {"type": "state", "detail": "half of ?"}
    theirs.close()
    assert channel.receive() is None


@pytest.mark.parametrize("line", [b"nonsense\n", b"[1]\n", b'{"no": "type"}\n', b'{"type": 1}\n', b"\xff\xfe\n"])
def test_what_is_no_message_is_invalid(ends, line):
    channel, theirs = ends
    theirs.sendall(line)
    with pytest.raises(Invalid):
        channel.receive()


def test_a_line_without_end_is_invalid(ends):
    channel, theirs = ends
    writer = threading.Thread(target=lambda: theirs.sendall(b"x" * (3 * LONGEST)), daemon=True)
    writer.start()
    with pytest.raises(Invalid, match="more than"):
        channel.receive()
