"""`python -m rapp_hop`: services of a module, in one process or several on one port."""

import asyncio
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from fakes.processes import ended
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError

TOKEN = "token-of-nao-0123456789"
MODULE = """
import os, time
from rapp_hop.service import Request, service

@service
def who(request: Request) -> dict:
    time.sleep(0.05)
    return {"pid": os.getpid(), "caller": request.caller}
"""


@contextmanager
def serving(folder: Path, *options: str) -> Iterator[tuple[subprocess.Popen[str], dict[str, Any]]]:
    (folder / "some_services.py").write_text(MODULE)
    (folder / "tokens.json").write_text(json.dumps({TOKEN: "nao"}))
    words = [sys.executable, "-m", "rapp_hop", "some_services", "--tokens", str(folder / "tokens.json")]
    words += ["--uploads", str(folder / "uploads"), *options]
    env = {**os.environ, "PYTHONPATH": str(folder)}
    process = subprocess.Popen(words, env=env, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield process, json.loads(process.stdout.readline().removeprefix("READY "))
    finally:
        process.terminate()
        try:
            process.wait(20)
        finally:
            process.kill()
            assert process.stdout is not None
            process.stdout.close()


async def callers_pids(port: int, calls: int) -> set[int]:
    client = HopClient(f"http://127.0.0.1:{port}", TOKEN, retries=5)
    found = await asyncio.gather(*(client.call("who") for _ in range(calls)))
    await client.close()
    assert {one["caller"] for one in found} == {"nao"}
    return {one["pid"] for one in found}


async def all_pids(port: int, count: int) -> set[int]:
    """Call until so many processes have answered."""
    seen: set[int] = set()
    async with asyncio.timeout(60):
        while len(seen) < count:
            seen |= await callers_pids(port, 16)
    return seen


def test_one_process(tmp_path: Path) -> None:
    with serving(tmp_path) as (process, ready):
        assert asyncio.run(callers_pids(ready["port"], 3)) == {process.pid}
    assert process.returncode == 0


@pytest.mark.timeout(180)
def test_several_processes_share_the_port_and_one_that_dies_is_replaced(tmp_path: Path) -> None:
    with serving(tmp_path, "--processes", "2") as (process, ready):
        pids = asyncio.run(all_pids(ready["port"], 2))
        assert pids == set(ready["pids"]) and process.pid not in pids
        victim = ready["pids"][0]
        os.kill(victim, signal.SIGKILL)
        later = asyncio.run(all_pids(ready["port"], 2))
        assert victim not in later and ready["pids"][1] in later
    assert process.returncode == 0
    assert all(ended(pid) for pid in pids | later)


@pytest.mark.timeout(180)
def test_no_process_outlives_the_first(tmp_path: Path) -> None:
    with serving(tmp_path, "--processes", "2") as (process, ready):
        process.kill()
        process.wait(20)

        async def wait() -> None:
            async with asyncio.timeout(30):
                while not all(ended(pid) for pid in ready["pids"]):
                    await asyncio.sleep(0.05)

        asyncio.run(wait())


@pytest.mark.parametrize(("module", "tokens"), [("json", '{"t": "x"}'), ("nowhere_to_be_found", "{}"), ("some_services", "[]")])
def test_what_cannot_be_served_is_said(tmp_path: Path, module: str, tokens: str) -> None:
    (tmp_path / "some_services.py").write_text(MODULE)
    (tmp_path / "tokens.json").write_text(tokens)
    words = [sys.executable, "-m", "rapp_hop", module, "--tokens", str(tmp_path / "tokens.json"), "--uploads", str(tmp_path / "u")]
    done = subprocess.run(
        words, env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 1 and "Traceback" not in done.stderr and done.stderr.strip()


def test_a_call_without_token_is_refused(tmp_path: Path) -> None:
    with serving(tmp_path) as (_, ready):

        async def main() -> None:
            client = HopClient(f"http://127.0.0.1:{ready['port']}")
            with pytest.raises(HopError) as caught:
                await client.call("who")
            assert caught.value.status == 401
            await client.close()

        asyncio.run(main())
