"""Heavy services: in worker processes, beside each other, never in the way of others, and reaped."""

import asyncio
import os
from pathlib import Path

import pytest

from fakes import heavy_services
from fakes.hop_house import House, visit
from rapp_hop.errors import Bug, Refused, Unreachable
from rapp_hop.service import service

ALL = [heavy_services.spin, heavy_services.pid, heavy_services.refuse, heavy_services.unsendable, heavy_services.die]


def test_heavy_services_run_beside_each_other_and_delay_nobody(tmp_path: Path) -> None:
    pids: set[int] = set()

    async def test(house: House) -> None:
        gate = str(tmp_path / "gate")
        spinning = [asyncio.create_task(house.client.call("spin", {"until": gate}, timeout=60)) for _ in range(2)]
        for _ in range(5):
            assert await house.client.call("add", {"a": 1}) == 2
            assert await house.client.call("pid", timeout=60) != os.getpid()
        assert not any(task.done() for task in spinning)
        (tmp_path / "gate").touch()
        found = await asyncio.gather(*spinning)
        pids.update([one["pid"] for one in found], [await house.client.call("pid")])
        assert [one["caller"] for one in found] == ["nao", "nao"]
        assert len(pids) == 3 and os.getpid() not in pids

    visit(test, tmp_path, *ALL)
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_errors_of_heavy_services(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        with pytest.raises(Refused, match="ask for something else") as caught:
            await house.client.call("refuse")
        assert caught.value.status == 403
        for name in ("unsendable", "die"):
            with pytest.raises(Bug):
                await house.client.call(name)
        with pytest.raises(Unreachable) as late:
            await house.client.call("hang")
        assert late.value.status == 408
        assert await house.alive()

    visit(test, tmp_path, *ALL, heavy_services.hang)


def test_what_cannot_run_in_a_worker_is_said_at_once() -> None:
    def inner() -> None: ...

    async def waiting() -> None: ...

    for function in (inner, waiting):
        with pytest.raises(TypeError, match="worker"):
            service(heavy=True)(function)
