"""The port `rapp_hop.hz.trust.Transport` straight from a shelf's folder."""

from pathlib import Path

from rapp_hop.errors import Refused
from rapp_hop.streaming import Progress, Writer


class StoreFolder:
    """Files of a store whose URL is `store:`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get(self, url: str, write: Writer, limit: int, on_progress: Progress | None, start: int = 0) -> None:
        path = self._folder / url.removeprefix("store:/")
        if not path.exists():
            raise Refused("cannot fetch it", 404)
        data = path.read_bytes()
        assert len(data) <= limit
        write(data[start:])
