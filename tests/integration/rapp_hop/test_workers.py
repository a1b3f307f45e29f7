"""Worker processes: real ones, that hang, die, and are reaped."""

import asyncio
import os

import pytest

from fakes.subject import Subject
from rapp_hop.errors import Bug, Unreachable
from rapp_hop.workers import Workers


def assert_gone(*pids: int) -> None:
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_a_worker_keeps_its_object_and_errors_come_back() -> None:
    seen: list[int] = []

    async def main() -> None:
        workers = Workers(Subject, 1)
        await workers.start()
        try:
            first, process = await workers.run("count", timeout=30)
            seen.append(process)
            assert process != os.getpid()
            with pytest.raises(ValueError, match="so it is"):
                await workers.run("fail", "so it is", timeout=30)
            assert await workers.run("count", timeout=30) == (first + 1, process)
        finally:
            await workers.close()

    asyncio.run(main())
    assert_gone(*seen)


def test_a_worker_that_hangs_or_dies_is_replaced() -> None:
    seen: list[int] = []

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
            assert_gone(first, second)
            seen.append(third)
        finally:
            await workers.close()

    asyncio.run(main())
    assert_gone(*seen)


def test_a_hanging_worker_does_not_hold_up_the_other() -> None:
    seen: list[int] = []

    async def main() -> None:
        workers = Workers(Subject, 2)
        await workers.start()
        try:
            hanging = asyncio.create_task(workers.run("hang", timeout=60))
            await asyncio.sleep(0)
            for expected in range(1, 4):
                count, process = await workers.run("count", timeout=30)
                seen.append(process)
                assert count == expected
            assert not hanging.done()
            hanging.cancel()
            with pytest.raises(asyncio.CancelledError):
                await hanging
        finally:
            await workers.close()

    asyncio.run(main())
    assert_gone(*seen)
