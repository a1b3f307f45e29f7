"""Child processes with a real other side: they start, say READY, end, and leave nothing behind."""

import asyncio
import os
import sys
import time
from pathlib import Path

import pytest

from rapp_cli import processes
from rapp_cli.errors import CommandError
from rapp_cli.home.supervisor import process_state
from rapp_cli.processes import Child, Children


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
    deadline = time.monotonic() + 20
    while process_state(grandchild) not in (None, "Z"):
        assert time.monotonic() < deadline
        time.sleep(0.02)
