"""A process that stands for many robots: each registers with its own token, then sends heartbeats as the link does.

    python -m benchmarks.store_crowd URL SECONDS    (on stdin a JSON object, robot to token)

Prints READY when all are registered, and a JSON object at the end.
"""

import asyncio
import json
import sys
from collections import Counter

import uvloop

from benchmarks.store_stage import PATIENCE, clock, share
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError
from rapp_link.cloud_side import SHORTEST
from rapp_link.config import Config


async def main(url: str, seconds: float, tokens: dict[str, str]) -> None:
    """Be all of them."""
    took: list[float] = []
    wrong: Counter[str] = Counter()
    ready = asyncio.Event()
    count = 0

    async def robot(number: int, name: str, token: str) -> None:
        nonlocal count
        client = HopClient(url, token)
        try:
            await asyncio.sleep(number * 0.01)  # they are not switched on at once
            period = await _register(client, name)
            count += 1
            if count == len(tokens):
                ready.set()
            while True:
                await asyncio.sleep(period)
                await _beat(client, name, took, wrong)
        finally:
            await client.close()

    robots = [asyncio.create_task(robot(number, *each)) for number, each in enumerate(tokens.items())]
    await asyncio.wait_for(ready.wait(), PATIENCE)
    print("READY", flush=True)
    took.clear()
    await asyncio.sleep(seconds)
    for each in robots:
        each.cancel()
    await asyncio.gather(*robots, return_exceptions=True)
    print(json.dumps({"heartbeats": len(took), "p99": share(took, 0.99), "wrong": wrong}), flush=True)


async def _register(client: HopClient, name: str) -> float:
    """Register, however often it takes, as the link does; gives the seconds between heartbeats."""
    while True:
        try:
            answer = await client.call("register", {"robot": name, "kind": "nao", "api_version": "1.0"}, timeout=10)
        except HopError:
            await asyncio.sleep(1)
        else:
            return max(SHORTEST, min(float(answer["lease"]) / 3, Config.heartbeat_most))


async def _beat(client: HopClient, name: str, took: list[float], wrong: Counter[str]) -> None:
    began = clock()
    try:
        answer = await client.call("heartbeat", {"robot": name}, timeout=10)
        wrong["registered no more"] += not answer["registered"]
    except HopError as error:
        wrong[str(error)] += 1
    took.append(clock() - began)


if __name__ == "__main__":
    uvloop.run(main(sys.argv[1], float(sys.argv[2]), json.load(sys.stdin)))
