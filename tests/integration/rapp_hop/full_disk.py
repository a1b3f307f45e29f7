"""Run inside a sandbox whose home is small, or read-only: installs hello, with ever more free space, and tells what comes of it.

Words: the store's folder, the robot's home, "full" or "once". Prints one JSON object per attempt.
"""

import asyncio
import json
import sys
from pathlib import Path

from rapp_hop.errors import HopError, Refused
from rapp_hop.hz.delivery import Delivery
from rapp_hop.streaming import Progress, Writer

STEP = 96 * 1024  # bytes by which there is more free space each time


class FolderClient:
    """As much of `HopClient` as a delivery asks for, straight from a store's folder."""

    base_url = "http://store.example"

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    async def download(
        self, path: str, write: Writer, limit: int, timeout: float = 60.0, on_progress: Progress | None = None,
        start: int = 0,
    ) -> int:  # fmt: skip
        file = self._folder / path.removeprefix(f"{self.base_url}/tuf/")
        if not file.exists():
            raise Refused("cannot fetch it", 404)
        data = file.read_bytes()
        write(data[start:])
        return len(data)


def attempt(store: Path, home: Path) -> dict[str, object]:
    """Install what is newest; tell how it went and what is there afterwards."""
    phases: list[str] = []
    delivery = Delivery(FolderClient(store), (store / "metadata/1.root.json").read_bytes(), home)  # type: ignore[arg-type]
    told: dict[str, object] = {}
    try:
        told["version"] = asyncio.run(delivery.install("hello", on_phase=lambda phase, _: phases.append(phase))).version
    except HopError as error:
        told |= {"error": str(error), "kind": error.kind}
    there = delivery.folder.find("hello")
    left = [path.name for folder in ("downloads", "rapps") if (home / folder).is_dir() for path in (home / folder).iterdir()]
    return {
        **told,
        "phase": phases[-1] if phases else "",
        "current": there.version if there else None,
        "program": (there.path / "agent.py").read_text() if there else "",
        "left": sorted(name for name in left if name not in (".lock", "hello")),
    }


def main(store: Path, home: Path, how: str) -> None:
    """Try until it succeeds, or once."""
    if how == "once":
        print(json.dumps(attempt(store, home)), flush=True)
        return
    filler = home / "filler"
    with filler.open("wb") as file:
        try:
            while True:
                file.write(bytes(16 * 1024))
                file.flush()
        except OSError:
            pass
    while True:
        told = attempt(store, home)
        print(json.dumps(told), flush=True)
        size = filler.stat().st_size
        if "version" in told or size == 0:
            return
        with filler.open("r+b") as file:
            file.truncate(max(0, size - STEP))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
