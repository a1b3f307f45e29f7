"""As much of `rapp_hop.client.HopClient` as a delivery asks for, straight from a store's folder."""

import asyncio
from pathlib import Path

from rapp_hop.errors import Refused
from rapp_hop.streaming import Progress, Writer


class StoreClient:
    """Serves a store's files; `held` keeps packages back while it is not set, `asked` tells what was asked for from which byte."""

    base_url = "http://store.example"

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.held: dict[str, asyncio.Event] = {}  # by RApp
        self.asked: list[tuple[str, int]] = []

    async def download(
        self, path: str, write: Writer, limit: int, timeout: float = 60.0, on_progress: Progress | None = None, start: int = 0
    ) -> int:
        file = self._folder / path.removeprefix(f"{self.base_url}/tuf/")
        if not file.exists():
            raise Refused("cannot fetch it", 404)
        if file.suffix == ".hz":
            name = file.name.split(".", 1)[1].rpartition("-")[0]
            self.asked.append((name, start))
            if name in self.held:
                await self.held[name].wait()
        data = file.read_bytes()
        write(data[start:])
        return len(data)
