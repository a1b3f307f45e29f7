"""The measurements of `rosbridge.py`: each gives the bridge's figures and those of the bare limit, taken one after the other."""

import asyncio
import json
import statistics
import time
from collections.abc import Awaitable, Callable
from typing import Any

from rosbridge_client import Client
from rosbridge_stage import Process, Stage

from fakes.bridge_wire import framed

Figures = dict[str, float]
Measured = tuple[Figures, Figures]

CALL = framed(b'{"op":"call_service","id":"12-34","service":"/bench/call","args":{"data":true}}')
SECONDS = 1.5  # of calls
ROUNDS = 5  # of ours and bare ones in turn
COUNTS = {"small": 20_000, "scan": 3000, "vga": 200, "hd": 60}  # messages of a flood
SIZES = {"small": 100, "scan": 23_000, "vga": 1_229_100, "hd": 4_915_500}  # bytes of its frames as JSON
KINDS = {"small": "std_msgs/String", "scan": "sensor_msgs/LaserScan", "vga": "sensor_msgs/Image", "hd": "sensor_msgs/Image"}


def percentile(values: list[float], part: int) -> float:
    """In ms, of seconds."""
    return sorted(values)[len(values) * part // 100] * 1000


async def calls(stage: Stage, clients: int) -> Measured:
    """As many answers as so many clients get, each with one call open; medians of some rounds."""
    ours, bare = [], []
    for _ in range(ROUNDS):
        ours.append(await _round(stage, clients, bare=False))
        bare.append(await _round(stage, clients, bare=True))
    return _median(ours), _median(bare)


def _median(rounds: list[Figures]) -> Figures:
    return {name: statistics.median(each[name] for each in rounds) for name in rounds[0]}


async def _round(stage: Stage, count: int, *, bare: bool) -> Figures:
    process = stage.bare if bare else stage.bridge
    async with stage.clients(count, bare=bare) as clients:
        took: list[float] = []
        await _ask_again(clients, [], 0.1)
        before, began = process.cpu(), time.monotonic()
        await _ask_again(clients, took, SECONDS / ROUNDS)
        span = time.monotonic() - began
        used = process.cpu() - before
    return {
        "per_s": len(took) / span, "p50_ms": percentile(took, 50), "p99_ms": percentile(took, 99), "cpu_us": used / len(took) * 1e6,
    }  # fmt: skip


async def _ask_again(clients: list[Client], took: list[float], seconds: float) -> None:
    end, done = time.monotonic() + seconds, []
    for client in clients:
        over = asyncio.get_running_loop().create_future()
        done.append(over)
        _keep_asking(client, end, took, over)
    await asyncio.gather(*done)


def _keep_asking(client: Client, end: float, took: list[float], over: "asyncio.Future[None]") -> None:
    began = 0.0

    def ask() -> None:
        nonlocal began
        began = time.monotonic()
        client.transport.write(CALL)

    def answered(_data: bytes) -> None:
        now = time.monotonic()
        took.append(now - began)
        if now < end:
            ask()
        else:
            client.on_message = None
            over.set_result(None)

    client.on_message = answered
    ask()


async def publish_flood(stage: Stage) -> Measured:
    """Strings from a client to a node; bare: from node to node."""
    count = COUNTS["small"]
    await stage.other.tell("listen", topic="/bench/in")
    await stage.node.tell("show", topic="/bench/in", kind="small")
    await stage.node.tell("flood", topic="/bench/in", kind="small", count=count)
    bare = await stage.other.tell("heard", topic="/bench/in", count=count)
    async with stage.clients(1) as (client,):
        client.send(op="advertise", topic="/bench/in", type="std_msgs/String")
        await client.settle()
        await asyncio.sleep(1.5)  # the node connects, and the topic's opening ends
        frame = framed(json.dumps({"op": "publish", "topic": "/bench/in", "msg": {"data": "x" * 32}}).encode())
        before = stage.bridge.cpu()
        for _ in range(count // 200):
            client.transport.write(frame * 200)
            await asyncio.sleep(0)
        heard = await stage.other.tell("heard", topic="/bench/in", count=count)
        used = stage.bridge.cpu() - before
    rate = heard["count"] / (heard["last"] - heard["first"])
    ours = {"per_s": rate, "cpu_us": used / count * 1e6, "lost": count - heard["count"]}
    return ours, {"per_s": bare["count"] / (bare["last"] - bare["first"])}


async def stream(stage: Stage, kind: str, compression: str, readers: int = 1) -> Measured:
    """Messages of a node to one client or several, as fast as they go; bare: frames as large, pushed."""
    count = COUNTS[kind] if readers == 1 else {"small": 400, "vga": 60}[kind]
    ours = await _streamed(stage, kind, compression, readers, count)
    bare = await _pushed(stage, SIZES[kind], count if kind != "small" else COUNTS[kind] // readers, readers)
    return ours, bare


async def _streamed(stage: Stage, kind: str, compression: str, readers: int, count: int) -> Figures:
    topic = f"/bench/{kind}_{compression.replace('-', '_')}_{readers}"
    await stage.node.tell("show", topic=topic, kind=kind)
    async with stage.clients(readers) as clients:
        for client in clients:
            client.send(op="subscribe", topic=topic, type=KINDS[kind], compression=compression)
            await client.settle()
            client.reset()
        before = stage.bridge.cpu()
        flood = stage.node.tell("flood", topic=topic, kind=kind, count=count)
        await asyncio.gather(*(client.counted(count) for client in clients))
        used, began = stage.bridge.cpu() - before, (await flood)["began"]
        came = sum(client.count for client in clients)
        span = max(client.last for client in clients) - began
    return {"per_s": came / span, "cpu_us": used / came * 1e6, "share": came / count / readers}


async def _pushed(stage: Stage, size: int, count: int, readers: int) -> Figures:
    async with stage.clients(readers, bare=True) as clients:
        word = "push" if readers == 1 else "fan"
        before, began = stage.bare.cpu(), time.monotonic()
        clients[0].transport.write(framed(f"{word} {size} {count}".encode()))
        await asyncio.gather(*(client.counted(count) for client in clients))
        used, came = stage.bare.cpu() - before, sum(client.count for client in clients)
        span = max(client.last for client in clients) - began
    return {"per_s": came / span, "cpu_us": used / came * 1e6}


async def tick(stage: Stage) -> Measured:
    """How late a small message of a topic with 200 a second comes; bare: the same messages at another node."""
    await stage.other.tell("listen", topic="/bench/tick")
    late = await _ticks(stage, "/bench/tick", 200, 0, 3.0, lambda: asyncio.sleep(0))
    bare = (await stage.other.tell("heard", topic="/bench/tick", count=0))["late"]
    ours, bare = ({"p50_ms": percentile(each, 50), "p99_ms": percentile(each, 99)} for each in (late, bare))
    return ours, bare


async def _ticks(
    stage: Stage, topic: str, hz: int, size: int, seconds: float, meanwhile: Callable[[], Awaitable[object]]
) -> list[float]:
    """By how much each message was late, s."""
    late: list[float] = []
    await stage.node.tell("show", topic=topic, kind="small")
    async with stage.clients(1) as (client,):
        client.send(op="subscribe", topic=topic, type="std_msgs/String")
        await client.settle()

        def look(data: bytes) -> None:
            at = data.find(b'"T', 0, 200)
            if at > 0:
                late.append(time.monotonic() - float(data[at + 2 : data.index(b";", at)]))

        client.on_message = look
        ticking = stage.node.tell("tick", topic=topic, hz=hz, seconds=seconds, size=size)
        await meanwhile()
        sent = (await ticking)["count"]
        await client.counted(client.count + 1)
    assert len(late) <= sent
    return late


async def slow_reader(stage: Stage) -> Measured:
    """100 messages of 100 kB a second to one who reads, beside one who does not."""
    topic, hz, seconds = "/bench/large", 100, 4.0
    before = stage.bridge.memory()
    most = before

    async def sleep_beside() -> None:
        nonlocal most
        async with stage.clients(1) as (sleeper,):
            sleeper.send(op="subscribe", topic=topic, type="std_msgs/String")
            sleeper.transport.pause_reading()
            for _ in range(int(seconds * 10)):
                await asyncio.sleep(0.1)
                most = max(most, stage.bridge.memory())

    late = await _ticks(stage, topic, hz, 100_000, seconds, sleep_beside)
    return {"hz": len(late) / seconds, "p99_ms": percentile(late, 99), "grown_mb": most - before}, {}


async def offered(stage: Stage) -> Measured:
    """A service that a client offers, called from ROS over one connection; bare: one of a node, called so."""
    bare = await stage.other.tell("call", service="/bench/call", persistent=True, seconds=1.0)
    async with stage.clients(1) as (provider,):
        provider.send(op="advertise_service", service="/bench/offered", type="std_srvs/SetBool")
        await provider.settle()
        provider.on_message = lambda data: provider.transport.write(_answer(json.loads(data)))
        before = stage.bridge.cpu()
        kept = await stage.other.tell("call", service="/bench/offered", persistent=True, seconds=SECONDS)
        used = stage.bridge.cpu() - before
        provider.on_message = None
        waiting = await _waiting_share(stage, provider)
    rate = {"per_s": len(kept["took"]) / sum(kept["took"]), "cpu_us": used / len(kept["took"]) * 1e6}
    return {**rate, "waiting_percent": waiting}, {"per_s": len(bare["took"]) / sum(bare["took"])}


def _answer(asked: dict[str, Any]) -> bytes:
    values = {"success": True, "message": ""}
    fields = {"op": "service_response", "service": asked["service"], "id": asked["id"], "result": True, "values": values}
    return framed(json.dumps(fields).encode())


async def _waiting_share(stage: Stage, provider: Client) -> float:
    """Per cent of a core that the bridge uses while an answer is awaited."""
    asking = stage.other.tell("call", service="/bench/offered", persistent=True, seconds=5.0, most=1)
    asked = await provider.receive("call_service")
    before, began = stage.bridge.cpu(), time.monotonic()
    await asyncio.sleep(1.5)
    share = (stage.bridge.cpu() - before) / (time.monotonic() - began)
    provider.transport.write(_answer(asked))
    await asking
    return share * 100


async def looked_up(stage: Stage) -> Measured:
    """The same by callers that ask the master and connect for each call; bare: those of a node's service."""
    bare = await stage.other.tell("call", service="/bench/call", persistent=False, seconds=1.0)
    async with stage.clients(1) as (provider,):
        provider.send(op="advertise_service", service="/bench/offered", type="std_srvs/SetBool")
        await provider.settle()
        provider.on_message = lambda data: provider.transport.write(_answer(json.loads(data)))
        ours = await stage.other.tell("call", service="/bench/offered", persistent=False, seconds=SECONDS)
    ours, bare = ({"per_s": len(each["took"]) / sum(each["took"])} for each in (ours, bare))
    return ours, bare


async def provider_leaves(stage: Stage) -> Measured:
    """How long a caller waits whose provider has gone."""
    async with stage.clients(1) as (provider,):
        provider.send(op="advertise_service", service="/bench/gone", type="std_srvs/SetBool")
        await provider.settle()
        asking = stage.other.tell("call", service="/bench/gone", persistent=True, seconds=5.0, most=1)
        await provider.receive("call_service")
        provider.close()
        began = time.monotonic()
        answer = await asking
    if not answer["error"]:
        raise SystemExit("cannot go on: a call was answered whose provider had gone")
    return {"seconds": time.monotonic() - began}, {}


async def visits(stage: Stage) -> Measured:
    """Clients that connect, subscribe, get a message and leave; bare: that connect, get an echo and leave."""
    await stage.node.tell("show", topic="/bench/latched", kind="small", latch=True)
    subscribe = framed(b'{"op":"subscribe","topic":"/bench/latched","type":"std_msgs/String"}')
    async with stage.clients(1) as (first,):
        first.transport.write(subscribe)
        await first.counted(1)  # so that the topic is there
        await _visit(stage, 200, subscribe, bare=False)
        await asyncio.sleep(1)
        memory, descriptors = stage.bridge.memory(), stage.bridge.descriptors()
        ours = await _visit(stage, 2000, subscribe, bare=False)
        await asyncio.sleep(1)
        ours |= {"grown_mb": stage.bridge.memory() - memory, "grown_fds": stage.bridge.descriptors() - descriptors}
    return ours, await _visit(stage, 1000, subscribe, bare=True)


async def _visit(stage: Stage, count: int, word: bytes, *, bare: bool) -> Figures:
    process: Process = stage.bare if bare else stage.bridge
    left = count

    async def visitor() -> None:
        nonlocal left
        while left > 0:
            left -= 1
            async with stage.clients(1, bare=bare) as (client,):
                got = asyncio.Event()
                client.on_message = lambda _data, got=got: got.set()  # type: ignore[misc]
                client.transport.write(word)
                await got.wait()

    before, began = process.cpu(), time.monotonic()
    await asyncio.gather(*(visitor() for _ in range(8)))
    return {"per_s": count / (time.monotonic() - began), "cpu_us": (process.cpu() - before) / count * 1e6}
