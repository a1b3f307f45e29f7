"""Child processes with a real other side: they start, say READY, end, and leave nothing behind."""

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fakes.processes import ended
from rapp_cli import processes
from rapp_cli.errors import CommandError
from rapp_cli.processes import Child, Children

CHILD = """
import os, signal, sys, time
def end(*_):
    print("told to end", flush=True)
    time.sleep(1.0)
    sys.exit()
signal.signal(signal.SIGTERM, end)
print('READY {"pid": %d}' % os.getpid(), flush=True)
time.sleep(600)
"""
COMMAND = """
import asyncio, os, sys
from pathlib import Path
from rapp_cli.processes import Child, Children, interruptible

async def work():
    async with Children() as children:
        for name in ("first", "second"):
            ready = await children.start(Child(name, [sys.executable, "-c", sys.argv[2]], os.environ, Path(sys.argv[1]) / name))
            print(ready["pid"], flush=True)
        await asyncio.sleep(600)

sys.exit(asyncio.run(interruptible(work(), "story")))
"""


def child(tmp_path: Path, code: str) -> Child:
    return Child("child", [sys.executable, "-c", code], os.environ, tmp_path / "child.log")


def test_ready_line_is_read_and_sigterm_ends_the_child(tmp_path: Path) -> None:
    async def story() -> dict[str, int]:
        async with Children() as children:
            return await children.start(
                child(tmp_path, "print('READY {\"port\": 7}', flush=True); input() if 0 else __import__('time').sleep(60)")
            )

    assert asyncio.run(story()) == {"port": 7}
    assert "READY" in (tmp_path / "child.log").read_text()


def test_a_child_that_ends_early_is_an_error_with_its_last_words(tmp_path: Path) -> None:
    async def story() -> None:
        async with Children() as children:
            await children.start(child(tmp_path, "raise SystemExit('cannot bind')"))

    with pytest.raises(CommandError, match="cannot bind"):
        asyncio.run(story())


def test_a_child_that_ignores_sigterm_is_killed_with_its_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "TERM_TIMEOUT", 0.2)
    code = (
        "import os, signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); pid = os.fork();"
        " print('READY {\"pid\": %d}' % pid, flush=True) if pid else None; time.sleep(60)"
    )

    async def story() -> int:
        async with Children() as children:
            return int((await children.start(child(tmp_path, code)))["pid"])

    grandchild = asyncio.run(story())
    await_that(lambda: ended(grandchild))


def await_that(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 20
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def _heed_signals() -> None:
    """A shell starts its background jobs with SIGINT ignored, and that is inherited."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


@pytest.fixture
def command(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A command with two children, which write to the files first and second."""
    words = [sys.executable, "-c", COMMAND, str(tmp_path), CHILD]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True, preexec_fn=_heed_signals) as process:
        yield process
        process.kill()


def pids(command: subprocess.Popen[str]) -> list[int]:
    assert command.stdout is not None
    return [int(command.stdout.readline()) for _ in range(2)]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_all_children_and_further_ones_do_not_hinder_that(
    command: subprocess.Popen[str], tmp_path: Path, number: signal.Signals
) -> None:
    running = pids(command)
    command.send_signal(number)
    await_that(lambda: "told to end" in (tmp_path / "second").read_text())
    command.send_signal(number)
    _, told = command.communicate(timeout=30)
    assert [pid for pid in running if not ended(pid)] == []
    assert (command.returncode, told) == (130, "rapp story: interrupted; every process is ended\n")


def test_children_end_with_a_command_that_is_killed(command: subprocess.Popen[str]) -> None:
    running = pids(command)
    command.kill()
    await_that(lambda: all(map(ended, running)))
