"""The live timeline: what the agents publish on /core_agent/state, read over rosbridge, as lines on the terminal."""

import asyncio
import json
import os
import sys
import time
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, TextIO

from tornado.websocket import websocket_connect

KINDS = ("entered", "left", "failed", "said", "heard", "message")
READING = "rapp_get_robot_pose"  # asked for again and again while the robot walks


@dataclass(frozen=True)
class Entry:
    """One line of the timeline; `kind` is one of KINDS."""

    agent: str
    machine: str
    state: str
    kind: str
    detail: str
    time: float = field(default_factory=time.time)  # s since 1970, when it happened


def append(record: Path, entry: Entry) -> None:
    """Write one entry at the end of a file of JSON lines; several processes may write to one file."""
    with record.open("a") as lines:
        lines.write(json.dumps(asdict(entry)) + "\n")


def latest(record: Path, size: int = 1 << 18) -> list[Entry]:
    """The last entries of such a file, as many as fit into `size` bytes; none when there is no file."""
    try:
        with record.open("rb") as lines:
            lines.seek(max(0, record.stat().st_size - size))
            found = lines.read().splitlines()
    except FileNotFoundError:
        return []
    return [entry for entry in map(_entry, found) if entry is not None]


def backwards(record: Path, words: Sequence[str] = ("",), most: int = 1 << 26, block: int = 1 << 18) -> Iterator[Entry]:
    """The entries of such a file whose line has one of the words, the last one first, out of its last `most` bytes.

    It is read as far as entries are taken, `block` bytes at a time.
    """
    wanted = [word.encode() for word in words]
    with suppress(FileNotFoundError), record.open("rb") as lines:
        end = lines.seek(0, os.SEEK_END)
        first, cut = max(0, end - most), b""
        while end > first:
            begin = max(first, end - block)
            lines.seek(begin)
            cut, *whole = (lines.read(end - begin) + cut).split(b"\n")
            for line in reversed([cut, *whole] if begin == 0 else whole):
                if any(word in line for word in wanted) and (entry := _entry(line)) is not None:
                    yield entry
            end = begin


def _entry(line: bytes) -> Entry | None:
    try:
        return Entry(**json.loads(line))
    except (ValueError, TypeError):
        return None  # the first of them may be cut in two, the last one unfinished


class Timeline:
    """Prints entries with the seconds since the start, keeps them, and records them as JSON lines when given a file."""

    def __init__(self, out: TextIO = sys.stdout, record: Path | None = None) -> None:
        self.entries: list[Entry] = []
        self._out = out
        self._record = record
        self._began = time.monotonic()
        self._changed = asyncio.Condition()

    async def add(self, entry: Entry) -> None:
        """Keep one entry, print it unless it is a mere leaving or reading, or within a core service, wake those who wait."""
        self.entries.append(entry)
        if self._record is not None:
            append(self._record, entry)
        if entry.kind != "left" and "/" not in entry.state and not entry.detail.endswith(READING):
            self._print(entry)
        async with self._changed:
            self._changed.notify_all()

    def _print(self, entry: Entry) -> None:
        what = {
            "entered": entry.detail,
            "failed": f"FAILED {entry.detail}",
            "said": f"says  “{entry.detail}”",
            "heard": f"hears “{entry.detail}”",
            "message": entry.detail,
        }[entry.kind]
        seconds = time.monotonic() - self._began
        print(f"{seconds:7.2f} s  {entry.agent:<8} {entry.state:<22} {what}".rstrip(), file=self._out, flush=True)

    async def wait_for(self, agent: str, kind: str, state: str, after: int = 0) -> int:
        """Wait for an entry at or after index `after`; gives the index behind it."""
        async with self._changed:
            while True:
                for index in range(after, len(self.entries)):
                    entry = self.entries[index]
                    if (entry.agent, entry.kind, entry.state) == (agent, kind, state):
                        return index + 1
                after = len(self.entries)
                await self._changed.wait()

    async def entry(self, index: int) -> Entry:
        """Wait for the entry of an index."""
        async with self._changed:
            await self._changed.wait_for(lambda: len(self.entries) > index)
            return self.entries[index]


async def follow(bridge: str) -> AsyncIterator[Entry]:
    """Subscribe to the agents' states at a rosbridge (ws://host:port); yields entries until the bridge leaves."""
    socket = await websocket_connect(bridge, connect_timeout=5)
    topic = {"topic": "/core_agent/state", "type": "rapp_msgs/AgentState", "queue_length": 1000}
    await socket.write_message(json.dumps({"op": "subscribe", **topic}))
    try:
        while (text := await socket.read_message()) is not None:
            message: dict[str, Any] = json.loads(text)
            if message.get("op") == "publish":
                m = message["msg"]
                moment = m["stamp"]["secs"] + m["stamp"]["nsecs"] * 1e-9
                yield Entry(m["agent"], m["machine"], m["state"], KINDS[m["kind"]], m["detail"], moment)
    finally:
        socket.close()
