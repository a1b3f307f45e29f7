"""Reports of runs on disk until the platform has them; each one is a file, removed after the platform has taken it."""

import asyncio
import json
import os
import secrets
from pathlib import Path
from typing import Any

from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Unreachable

MOST = 200  # kept at once; the oldest goes first


class Reports:
    """A folder of reports; each carries an id of its own, by which the platform knows one sent twice."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def put(self, run: dict[str, Any]) -> None:
        """Keep one report."""
        kept = sorted(self._folder.glob("*.json"), key=lambda f: f.stat().st_mtime)
        for oldest in kept[: max(0, len(kept) - MOST + 1)]:
            oldest.unlink()
        name = secrets.token_hex(12)
        aside = self._folder / f"{name}.new"
        with aside.open("w") as file:
            json.dump({"id": name, **run}, file)
            file.flush()
            os.fsync(file.fileno())
        aside.replace(self._folder / f"{name}.json")

    async def send_all(self, client: HopClient) -> int:
        """Send all that are kept; gives how many are left because the platform is away."""
        kept = sorted(self._folder.glob("*.json"), key=lambda f: f.stat().st_mtime)
        for done, path in enumerate(kept):
            run = json.loads(await asyncio.to_thread(path.read_text))
            try:
                await client.call("report", {"run": run})
            except Unreachable:
                return len(kept) - done
            except HopError:
                path.rename(path.with_suffix(".refused"))
                continue
            path.unlink()
        return 0
