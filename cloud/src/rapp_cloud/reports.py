"""What robots tell of their runs: `reports/<robot>/<run>.json`, the newest kept, the oldest thrown away."""

import hashlib
import re
from pathlib import Path
from typing import Any

from rapp_cloud.files import write_whole
from rapp_hop import strict_json
from rapp_hop.hz.text import check_name

KEPT = 1000  # reports per robot
_RUN = re.compile(r"[A-Za-z0-9_-]{1,80}", re.ASCII)


class Reports:
    """The reports of one platform. Blocking."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def keep(self, robot: str, run: dict[str, Any]) -> str:
        """Keep a report and return its name; the same run again replaces it, so that sending twice does no harm."""
        text = strict_json.dumps(run)
        name = str(run.get("run", run.get("id", "")))
        if not _RUN.fullmatch(name):
            name = hashlib.sha256(text.encode()).hexdigest()
        folder = self._folder / check_name(robot)
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        write_whole(folder / f"{name}.json", text.encode(), mode=0o600)
        for path in sorted(folder.glob("*.json"), key=lambda path: path.stat().st_mtime_ns)[:-KEPT]:
            path.unlink(missing_ok=True)
        return name
