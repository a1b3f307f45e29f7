"""Cuts one operation on a robot's disk off at every step: power gone (SIGKILL), or disk full from there on; tells what is left.

Words: the store's folder, the home to begin with, a working folder, the operation, "killed" or "full". A step is a call that
changes the disk, whoever makes it. Prints one JSON object per step: what was there after the cut and the next start, and after the
operation was done again. Each try is a process of its own; this one starts no threads.
"""

import asyncio
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from fakes.cutting import Cut, cutter, every_step, one_try, put_in
from rapp_hop.errors import HopError, Refused
from rapp_hop.hz.delivery import Delivery
from rapp_hop.streaming import Progress, Writer

PIECE = 32 * 1024  # bytes that come at once


class Client:
    """As much of `HopClient` as a delivery asks for, straight from a store's folder, in pieces."""

    base_url = "http://store.example"

    def __init__(self, folder: Path, cut: Cut) -> None:
        self._folder, self._cut = folder, cut

    async def download(
        self, path: str, write: Writer, limit: int, timeout: float = 60.0, on_progress: Progress | None = None, start: int = 0
    ) -> int:
        file = self._folder / path.removeprefix(f"{self.base_url}/tuf/")
        if not file.exists():
            raise Refused("cannot fetch it", 404)
        data = file.read_bytes()
        for place in range(start, len(data), PIECE):
            self._cut("write")
            write(data[place : place + PIECE])
        return len(data)


OPERATIONS: dict[str, Callable[[Delivery], Awaitable[object]]] = {
    "install": lambda delivery: delivery.install("hello"),
    "started": lambda delivery: delivery.started("hello", "1.1.0", ok=True),
    "did not start": lambda delivery: delivery.started("hello", "1.1.0", ok=False),
    "remove": lambda delivery: delivery.remove("hello"),
}


def look(home: Path) -> dict[str, Any]:
    """What is there, and whether the current version is whole."""
    rapp, downloads = home / "rapps" / "hello", home / "downloads"
    current = rapp / "current"
    return {
        "current": str(current.readlink()) if current.is_symlink() else None,
        "files": {path.name: path.read_text() for path in sorted(current.glob("*.*"))},
        "names": sorted(path.name for path in rapp.glob("*")),
        "rapps": sorted(path.name for path in (home / "rapps").glob("*")),
        "downloads": sorted(path.suffix for path in downloads.glob("*")),
    }


def attempt(store: Path, home: Path, operation: str, cut: Cut) -> str:
    """Do it; gives the error, if any, in words."""
    delivery = Delivery(Client(store, cut), (store / "metadata/1.root.json").read_bytes(), home)  # type: ignore[arg-type]
    try:
        asyncio.run(OPERATIONS[operation](delivery))  # type: ignore[arg-type]
    except HopError as error:
        return f"{error.kind}: {error}"
    return ""


def start_again(store: Path, home: Path) -> None:
    """As the link does when it starts."""
    asyncio.run(Delivery(Client(store, lambda _: None), b"", home).tidy())  # type: ignore[arg-type]


def cut_off(store: Path, home: Path, operation: str, how: str, step: int) -> dict[str, Any]:
    """One try: cut off, start again, do it again."""

    def tried() -> dict[str, Any]:
        seen: list[str] = []
        put_in(cutter(how, step, seen))
        return {
            "error": attempt(store, home, operation, cutter(how, step, seen) if how == "killed" else lambda _: None),
            "steps": len(seen),
        }

    def recovered() -> dict[str, Any]:
        start_again(store, home)
        after = look(home)
        return {"after": after, "again": attempt(store, home, operation, lambda _: None), "end": look(home)}

    return one_try(step, tried, recovered)


def main(store: Path, begin: Path, work: Path, operation: str, how: str) -> None:
    """Go on until the operation comes to its end."""
    every_step(begin, work, lambda step: cut_off(store, work, operation, how, step))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4], sys.argv[5])
