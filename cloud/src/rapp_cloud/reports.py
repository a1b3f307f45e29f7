"""What robots tell of their runs; of each robot the newest are kept, the oldest thrown away."""

import hashlib
import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from rapp_cloud.database.engine import Database
from rapp_cloud.database.tables import runs
from rapp_cloud.files import read_json
from rapp_hop import strict_json
from rapp_hop.errors import HopError
from rapp_hop.hz.text import check_name

KEPT = 1000  # reports per robot
MAX_REPORT = 256 * 1024  # bytes
_RUN = re.compile(r"[A-Za-z0-9_-]{1,80}", re.ASCII)


class Reports:
    """The reports of one platform. Blocking."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def keep(self, robot: str, run: dict[str, Any]) -> str:
        """Keep a report and return its name; the same run again replaces it, so that sending twice does no harm."""
        text = strict_json.dumps(run)
        name = str(run.get("run", run.get("id", "")))
        if not _RUN.fullmatch(name):
            name = hashlib.sha256(text.encode()).hexdigest()
        row = {"robot": check_name(robot), "run": name, "received": time.time(), "report": text}
        mine = runs.c.robot == robot
        with self._database.writing() as connection:
            connection.execute(sa.delete(runs).where(mine, runs.c.run == name))
            connection.execute(sa.insert(runs).values(row))
            newest = sa.select(runs.c.run).where(mine).order_by(runs.c.received.desc(), runs.c.run).limit(KEPT)
            connection.execute(sa.delete(runs).where(mine, runs.c.run.not_in(newest)))
        return name

    def of(self, robot: str) -> list[dict[str, Any]]:
        """Return a robot's reports, the newest first."""
        wanted = sa.select(runs.c.report).where(runs.c.robot == robot).order_by(runs.c.received.desc(), runs.c.run)
        with self._database.reading() as connection:
            return [strict_json.loads(text.encode(), limit=MAX_REPORT) for text in connection.execute(wanted).scalars()]

    def adopt(self, folder: Path) -> None:
        """Take over the files `<robot>/<run>.json` of an older platform; the folder is gone afterwards."""
        for robot, run in _left_in(folder):
            self.keep(robot, run)
        shutil.rmtree(folder, ignore_errors=True)


def _left_in(folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    for path in sorted(folder.glob("*/*.json"), key=lambda path: path.stat().st_mtime_ns):
        try:
            run = read_json(path, MAX_REPORT)
            if isinstance(run, dict):
                yield check_name(path.parent.name), run
        except HopError:  # a damaged one is of no use to anybody
            continue
