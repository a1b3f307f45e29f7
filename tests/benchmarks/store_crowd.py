"""A process that stands for many robots: each registers with its own token, then sends heartbeats as the link does.

    python -m benchmarks.store_crowd URL SECONDS    (on stdin a JSON object, robot to token)

Prints READY when all are registered, and a JSON object at the end.
"""

import asyncio
import json
import sys
from collections import Counter

import uvloop

from benchmarks.store_stage import clock, share
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
            answer = await client.call("register", {"robot": name, "kind": "nao", "api_version": "1.0"})
            period = max(SHORTEST, min(answer["lease"] / 3, Config.heartbeat_most))
            count += 1
            if count == len(tokens):
                ready.set()
            while True:
                await asyncio.sleep(period)
                await _beat(client, name, took, wrong)
        finally:
            await client.close()

    robots = [asyncio.create_task(robot(number, *each)) for number, each in enumerate(tokens.items())]
    await asyncio.wait([asyncio.create_task(ready.wait()), *robots], return_when=asyncio.FIRST_COMPLETED)
    for each in robots:
        if each.done():
            each.result()
    print("READY", flush=True)
    took.clear()
    await asyncio.sleep(seconds)
    for each in robots:
        each.cancel()
    await asyncio.gather(*robots, return_exceptions=True)
    print(json.dumps({"heartbeats": len(took), "p99": share(took, 0.99), "wrong": wrong}), flush=True)


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
