"""Worker processes: real ones, that hang, die, and are reaped."""

import asyncio
import multiprocessing
import os
import signal
import time

import pytest

from rapp_hop.errors import Bug, Unreachable
from rapp_hop.workers import Workers


class Subject:
    """What a worker holds."""

    def __init__(self) -> None:
        self._calls = 0

    def count(self) -> tuple[int, int]:
        self._calls += 1
        return self._calls, os.getpid()

    def fail(self, text: str) -> None:
        raise ValueError(text)

    def hang(self) -> None:
        time.sleep(600)

    def die(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)




def test_a_worker_keeps_its_object_and_errors_come_back() -> None:
    async def main() -> None:
        workers = Workers(Subject, 1)
        await workers.start()
        try:
            first, process = await workers.run("count", timeout=30)
            assert process != os.getpid()
            with pytest.raises(ValueError, match="so it is"):
                await workers.run("fail", "so it is", timeout=30)
            assert await workers.run("count", timeout=30) == (first + 1, process)
        finally:
            await workers.close()

    asyncio.run(main())
    assert multiprocessing.active_children() == []


def test_a_worker_that_hangs_or_dies_is_replaced() -> None:
    async def main() -> None:
        workers = Workers(Subject, 1)
        await workers.start()
        try:
            _, first = await workers.run("count", timeout=30)
            with pytest.raises(Unreachable, match="try again later"):
                await workers.run("hang", timeout=0.3)
            _, second = await workers.run("count", timeout=30)
            with pytest.raises(Bug, match="died"):
                await workers.run("die", timeout=30)
            _, third = await workers.run("count", timeout=30)
            assert len({first, second, third}) == 3
            for gone in (first, second):
                with pytest.raises(ProcessLookupError):
                    os.kill(gone, 0)
        finally:
            await workers.close()

    asyncio.run(main())
    assert multiprocessing.active_children() == []


def test_a_hanging_worker_does_not_hold_up_the_other() -> None:
    async def main() -> None:
        workers = Workers(Subject, 2)
        await workers.start()
        try:
            hanging = asyncio.create_task(workers.run("hang", timeout=60))
            await asyncio.sleep(0)
            for expected in range(1, 4):
                assert (await workers.run("count", timeout=30))[0] == expected
            assert not hanging.done()
            hanging.cancel()
            with pytest.raises(asyncio.CancelledError):
                await hanging
        finally:
            await workers.close()

    asyncio.run(main())
    assert multiprocessing.active_children() == []
