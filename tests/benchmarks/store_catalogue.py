"""A store with very many RApps: what it takes to list them, to interpret a command, and to publish one more."""

import argparse
import asyncio
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from tuf.api.metadata import TargetFile  # type: ignore[attr-defined]  # public, but not in __all__

from benchmarks.store_stage import Platform, clock, cpu, family, memory, share, write_rapp
from benchmarks.store_words import invented
from rapp_cloud.keys import KeyRing
from rapp_cloud.ledger import Ledger
from rapp_cloud.register import add_publisher, delegated
from rapp_hop.client import HopClient
from rapp_hop.hz.archive import build, package_file_name
from rapp_hop.hz.standing import pattern

MEANT = ("winter_song", ["sing the winter song for me", "would you sing my winter song", "I want you to sing a winter song"])
PUBLISHERS = 100  # who share the RApps
REGISTER = {"kind": "nao", "api_version": "1.0"}


def fill(platform: Platform, rapps: list[tuple[str, list[str]]]) -> None:
    """Offer all of them at once, each publisher's part signed as `rapp_cloud publish` signs."""
    tuf = platform.data / "tuf"
    ledger = Ledger(tuf / "metadata", KeyRing(platform.data / "keys"))
    with ledger.locked():
        lists = ledger.read()
        names = [f"publisher_{number:02}" for number in range(min(PUBLISHERS, len(rapps)))]
        for name in names:
            add_publisher(ledger, lists, name)
        for number, (name, sentences) in enumerate(rapps):
            package, publisher = _built(name, sentences), names[number % len(names)]
            path = package_file_name(name, "1.0.0")
            target = TargetFile.from_data(path, package, ["sha256"])
            target.unrecognized_fields["custom"] = {"name": name, "version": "1.0.0"}
            lists.publishers[publisher].targets[path] = target
            delegated(lists)[publisher].paths = [*(delegated(lists)[publisher].paths or ()), pattern(name)]
            (tuf / "targets" / f"{target.hashes['sha256']}.{path}").write_bytes(package)
        ledger.write(lists, ["targets", *names])


def _built(name: str, sentences: list[str]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return build(write_rapp(Path(folder) / name, name, sentences=sentences))


def measure(folder: Path, options: argparse.Namespace) -> None:
    """Print the table."""
    print(f"{'RApps in the store':<36}" + "".join(f"{count:>12}" for count in options.rapps))
    columns = [_column(folder / str(count), count, options) for count in options.rapps]
    for name in columns[0]:
        print(f"{name:<36}" + "".join(f"{column[name]:>12}" for column in columns))


def _column(folder: Path, count: int, options: argparse.Namespace) -> dict[str, str]:
    folder.mkdir()
    platform, rapps = Platform(folder), [MEANT, *invented(count - 1)]
    fill(platform, rapps)
    said = _spoken(folder / "said.wav", MEANT[1][0])
    found: dict[str, str] = {}
    for start in ("first start", "next start"):
        began = clock()
        with platform.serving():
            found[f"{start}, s"] = f"{platform.ready - began:.2f}"
            found[f"{start}, until all is learnt, s"] = f"{platform.settled - began:.1f}"
            if start == "next start":
                found |= asyncio.run(_served(platform, said, options))
    shutil.rmtree(folder)
    return found


async def _served(platform: Platform, said: Path, options: argparse.Namespace) -> dict[str, str]:
    client = HopClient(platform.url, platform.token)
    beating = asyncio.create_task(_stay(client))

    async def interpret() -> Any:
        return await client.call("interpret", {"recording": said, "language": "en"}, timeout=600)

    async def listed() -> Any:
        return await client.call("list_rapps", timeout=600)

    try:
        await client.call("register", REGISTER)
        found = {
            "first list, s": f"{await _took(listed):.2f}",
            **await _often("list", listed, platform, options.calls),
            "first interpretation, s": f"{await _took(interpret):.2f}",
            **await _often("interpretation", interpret, platform, options.calls),
            "the RApp meant is candidate": _place(await interpret(), MEANT[0]),
        }
        one_more = write_rapp(platform.data.parent / "one_more", "one_more", sentences=["juggle seven oranges for the children"])
        began, used = clock(), _of_children()
        await asyncio.to_thread(platform.publish, one_more)
        found |= {
            "publish one more, s, its CPU s": f"{clock() - began:.2f} {_of_children() - used:.2f}",
            "next list, s": f"{await _took(listed):.2f}",
            "next interpretation, s": f"{await _took(interpret):.2f}",
        }
        assert "one_more" in {rapp["name"] for rapp in (await listed())["rapps"]}
    finally:
        beating.cancel()
        await client.close()
    pids = family(platform.pid)
    return {
        **found,
        "memory of rapp-cloud, MiB": f"{memory(platform.pid):.0f}",
        "of its largest worker, MiB": f"{max(map(memory, pids[1:]), default=0):.0f}",
    }


async def _stay(client: HopClient) -> None:
    while True:
        await asyncio.sleep(4)
        await client.call("heartbeat", timeout=600)


async def _took(work: Callable[[], Awaitable[Any]]) -> float:
    began = clock()
    await work()
    return clock() - began


async def _often(name: str, work: Callable[[], Awaitable[Any]], platform: Platform, calls: int) -> dict[str, str]:
    pids = family(platform.pid)
    used = cpu(pids)
    took = [await _took(work) for _ in range(calls)]
    return {
        f"{name}, p50 and p99 ms": f"{1000 * share(took, 0.5):.0f} {1000 * share(took, 0.99):.0f}",
        f"{name}, the platform's CPU ms": f"{1000 * (cpu(pids) - used) / calls:.0f}",
    }


def _of_children() -> float:
    """Processor seconds of commands that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _place(answer: dict[str, Any], meant: str) -> str:
    names = [each["rapp"] for each in answer["candidates"]]
    return f"no. {names.index(meant) + 1}" if meant in names else "not there"


def _spoken(path: Path, text: str) -> Path:
    subprocess.run(["espeak-ng", "-v", "en-us+m3", "-s", "150", "-w", str(path), text], check=True, timeout=30)
    return path
