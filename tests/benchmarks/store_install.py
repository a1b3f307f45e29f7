"""Installation through the link's own code from a real platform, by phase; on a robot that has nothing, and as an update."""

import argparse
import asyncio
import os
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.store_stage import MEGABYTE, Platform, clock, share, write_rapp
from rapp_cloud.app import open_shelf
from rapp_hop.client import HopClient
from rapp_hop.hz.archive import build
from rapp_hop.hz.delivery import Delivery, Recipient

SIZES = {"small": 0, "1 MB": MEGABYTE}  # bytes that cannot be packed any smaller
PHASES = ("metadata", "download", "verify", "unpack", "fsync", "total")
ROBOT = Recipient("nao", "nao", "1.0")


class Disk:
    """Seconds that this process has waited for the disk to have it all."""

    def __init__(self) -> None:
        self.waited = 0.0
        self._lock = threading.Lock()

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Count while the block runs."""
        fsync = os.fsync

        def counted(file: Any) -> None:
            began = clock()
            fsync(file)
            with self._lock:
                self.waited += clock() - began

        os.fsync = counted
        try:
            yield
        finally:
            os.fsync = fsync


def measure(folder: Path, options: argparse.Namespace) -> None:
    """Print the table."""
    platform = Platform(folder)
    for name, size in SIZES.items():
        _publish(platform, folder, name, size, 0)
    print(f"{'installation, p50 in ms':<26}" + "".join(f"{phase:>10}" for phase in PHASES))
    with platform.serving():
        for name, size in SIZES.items():
            asyncio.run(_measure(platform, folder, name, size, options.installs))


async def _measure(platform: Platform, folder: Path, name: str, size: int, count: int) -> None:
    client = HopClient(platform.url, platform.token)
    rows: dict[str, list[dict[str, float]]] = {"nothing there": [], "update": []}
    try:
        for number in range(1, count + 1):
            home = folder / f"home_{number}"
            rows["nothing there"].append(await _install(client, platform, home, name))
            await asyncio.to_thread(_publish, platform, folder, name, size, number)
            rows["update"].append(await _install(client, platform, home, name))
            await asyncio.to_thread(shutil.rmtree, home)
    finally:
        await client.close()
    for what, found in rows.items():
        values = [share([each[phase] for each in found], 0.5) for phase in PHASES]
        print(f"{f'{name}, {what}':<26}" + "".join(f"{1000 * value:>10.1f}" for value in values))


async def _install(client: HopClient, platform: Platform, home: Path, name: str) -> dict[str, float]:
    delivery = Delivery(client, (platform.data / "root.json").read_bytes(), home)
    marks: dict[str, float] = {}

    def on_phase(phase: str, details: dict[str, Any]) -> None:
        if phase == "downloading":
            marks.setdefault("metadata", clock())
            if details.get("bytes") == details.get("of"):
                marks["download"] = clock()
        else:
            marks[phase] = clock()

    disk, began = Disk(), clock()
    with disk.watched():
        done = await delivery.install(_rapp(name), None, on_phase, ROBOT)
    end = clock()
    assert done.new
    return {
        "metadata": marks["metadata"] - began,
        "download": marks["download"] - marks["metadata"],
        "verify": marks["verified"] - marks["download"],
        "unpack": marks["installed"] - marks["verified"] - disk.waited,
        "fsync": disk.waited,
        "total": end - began,
    }


def _publish(platform: Platform, folder: Path, name: str, size: int, number: int) -> None:
    source = write_rapp(folder / f"{_rapp(name)}_{number}", _rapp(name), f"1.{number}.0", size)
    open_shelf(platform.data).publish(build(source))


def _rapp(name: str) -> str:
    return "rapp_" + name.replace(" ", "_").lower()
