"""A platform's bookkeeping goes on whatever one part of it meets, and it says that it is not ready when it does not."""

import asyncio
import logging
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from rapp_cloud import memory as memory_module
from rapp_cloud.health import checks_of
from rapp_cloud.memory import OVERDUE, open_memory, remembering
from rapp_cloud.registrations import Registrations
from rapp_cloud.robots import Robots
from rapp_hop.errors import Unreachable

PATIENCE = 30.0  # s


async def _until(true: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not true():
            await asyncio.sleep(0.02)


@pytest.mark.parametrize("always", [False, True])
def test_one_fault_does_not_end_the_bookkeeping(
    database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, always: bool
) -> None:
    monkeypatch.setattr(memory_module, "STEP", 0.02)
    tries: list[int] = []

    def write(_self: Registrations) -> None:
        tries.append(1)
        if always or len(tries) == 1:
            raise ZeroDivisionError("a fault of ours")

    monkeypatch.setattr(Registrations, "write", write)
    with open_memory(tmp_path, database_url) as command:
        token = command.accounts.add_robot("nao")

    async def main() -> None:
        async with remembering(tmp_path, database_url, Robots(time.monotonic, 30)) as memory:
            await _until(lambda: len(tries) > 2)
            with open_memory(tmp_path, database_url) as command:
                command.accounts.revoke("nao")
            memory.audit.note("nao", "run", "hello")
            await _until(lambda: memory.accounts.name_of(token) is None and bool(memory.audit.entries()))
            memory._stepped -= OVERDUE
            check = checks_of(memory, tmp_path, tmp_path / "timestamp.json", None)[1]
            if always:
                with pytest.raises(Unreachable, match="in step with the database"):
                    check()
            else:
                before = memory._stepped
                await _until(lambda: memory._stepped > before)
                check()

    with caplog.at_level(logging.ERROR):
        asyncio.run(main())
    (told,) = [record for record in caplog.records if record.name == "rapp_cloud.memory"]
    assert "a fault of ours" in told.getMessage() and told.exc_info
