"""What the platform takes, asked through rosbridge and link as by the core agent: cloud agents, and a call beside its HTTP call."""

import asyncio
import json
import statistics
import time
import uuid
from dataclasses import dataclass

from tornado.websocket import WebSocketClientConnection, websocket_connect

from rapp_cli.cloud import Cloud
from rapp_hop.client import HopClient

FOUR_AGENTS = {"rapp": "hazard_detection", "version": "1.0.0"}
SERVICE = "profile"
CALLS = 50  # for each agent
WARM = 2.0  # s in which the platform has a spare again
PATIENCE = 15.0  # s
DONE, FAILED = 1, 2  # rapp_msgs/HopEvent
READY = 0.100  # s from the order of a cloud agent until it serves (DESIGN section 4)
ABOVE = 0.008  # s of a call through the link above its HTTP call (the same)


@dataclass(frozen=True)
class CloudWays:
    """Medians in s."""

    ready: float
    through_link: float
    http: float

    def verdict(self) -> bool:
        """Print the budgets, and whether they are kept."""
        above = self.through_link - self.http
        print(f"cloud agent, from its order through the link until it serves: {self.ready * 1000:.0f} ms", end=" ")
        print(f"(at most {READY * 1000:.0f})")
        print(f"cloud call through the link: {self.through_link * 1000:.1f} ms, {above * 1000:.1f} above its HTTP call", end=" ")
        print(f"(at most {ABOVE * 1000:.0f})")
        return self.ready <= READY and above <= ABOVE


async def measure_cloud(bridge: str, cloud: Cloud, rounds: int) -> CloudWays:
    """Start and stop a cloud agent so many times; between, calls both ways in turn, so that a busy machine slows both."""
    client = HopClient(cloud.url, cloud.token_file.read_text().strip(), ca_file=cloud.ca_file)
    socket = await websocket_connect(bridge, connect_timeout=5)
    topic = {"topic": "rapp_hop/events", "type": "rapp_msgs/HopEvent", "queue_length": 1000}
    await socket.write_message(json.dumps({"op": "subscribe", **topic}))
    ready, linked, plain = [], [], []
    try:
        for number in range(rounds):
            await asyncio.sleep(WARM)
            run = f"bench-{number}"
            ready.append(await _ask(socket, "start_cloud_agent", {**FOUR_AGENTS, "run": run}))
            for _ in range(CALLS):
                linked.append(await _ask(socket, "call", {"service": SERVICE, "arguments": {}}))
                began = time.perf_counter()
                await client.call(SERVICE)
                plain.append(time.perf_counter() - began)
            await _ask(socket, "stop_cloud_agent", {"run": run})
    finally:
        socket.close()
        await client.close()
    return CloudWays(*map(statistics.median, (ready, linked, plain)))


async def _ask(socket: WebSocketClientConnection, name: str, arguments: dict[str, object]) -> float:
    """Seconds from a request to the end of its job."""
    job = uuid.uuid4().hex
    args = {"job": job, "arguments": json.dumps(arguments), "timeout": PATIENCE}
    began = time.perf_counter()
    await socket.write_message(json.dumps({"op": "call_service", "service": f"rapp_hop/{name}", "args": args}))
    async with asyncio.timeout(PATIENCE):
        while (text := await socket.read_message()) is not None:
            event = json.loads(text).get("msg", {})
            if event.get("job") == job and event["kind"] in (DONE, FAILED):
                if event["kind"] == FAILED:
                    raise SystemExit(f"cannot measure {name}: {event['message']}")
                return time.perf_counter() - began
    raise SystemExit(f"cannot measure {name}: the bridge has gone")
