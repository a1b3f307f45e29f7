"""Many robots registered with one platform, with their heartbeats; and another one that asks for the catalogue meanwhile."""

import argparse
import asyncio
import json
import subprocess
import sys
from pathlib import Path

from benchmarks.store_stage import PATIENCE, Platform, clock, cpu, memory, millis, write_rapp
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError

RAPPS = 20  # in the catalogue
PAUSE = 0.05  # s between two calls to it


def measure(folder: Path, options: argparse.Namespace) -> None:
    """Print the table."""
    platform = Platform(folder)
    platform.publish(*(write_rapp(folder / f"rapp_{number}", f"rapp_{number}") for number in range(RAPPS)))
    tokens = platform.robots(options.robots)
    print(f"{'registered robots':<26}{'heartbeats/s':>13}{'CPU share':>10}{'MiB':>8}   list_rapps:{'p50 ms':>8}{'p99 ms':>9}")
    with platform.serving():
        _row("none", platform, None, options)
        words = [sys.executable, "-m", "benchmarks.store_crowd", platform.url, str(options.watch)]
        crowd = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        try:
            assert crowd.stdin is not None and crowd.stdout is not None
            crowd.stdin.write(json.dumps(tokens))
            crowd.stdin.close()
            if crowd.stdout.readline() != "READY\n":
                raise SystemExit("cannot go on: the robots could not register")
            _row(str(options.robots), platform, crowd, options)
        finally:
            crowd.kill()
            crowd.wait(PATIENCE)


def _row(name: str, platform: Platform, crowd: subprocess.Popen[str] | None, options: argparse.Namespace) -> None:
    used, began = cpu([platform.pid]), clock()
    took = asyncio.run(_ask(platform, options.watch))
    part = (cpu([platform.pid]) - used) / (clock() - began)
    rate = 0.0
    if crowd is not None:
        assert crowd.stdout is not None
        told = json.loads(crowd.stdout.readline())
        rate = told["heartbeats"] / options.watch
        if wrong := {what: count for what, count in told["wrong"].items() if count}:
            print(f"heartbeats that failed: {wrong}")
    print(f"{name:<26}{rate:>13.0f}{100 * part:>9.1f}%{memory(platform.pid):>8.0f}   {'':<11}{millis(took)}")


async def _ask(platform: Platform, seconds: float) -> list[float]:
    client, took = HopClient(platform.url, platform.token), []
    try:
        await client.call("register", {"kind": "nao", "api_version": "1.0"})
        end = clock() + seconds
        while clock() < end:
            try:
                await client.call("heartbeat")
                began = clock()
                await client.call("list_rapps")
                took.append(clock() - began)
            except HopError as error:  # all robots of this machine have one address, of which a platform takes 300 connections
                print(f"a call failed: {error}")
            await asyncio.sleep(PAUSE)
    finally:
        await client.close()
    return took
