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

    def keep(self, robot: str, run: dict[str, Any]) -> tuple[str, bool]:
        """Keep a report; return its name, and whether it is new: the same run again replaces it, so sending twice does no harm."""
        text = strict_json.dumps(run)
        name = str(run.get("run", run.get("id", "")))
        if not _RUN.fullmatch(name):
            name = hashlib.sha256(text.encode()).hexdigest()
        row = {"robot": check_name(robot), "run": name, "received": time.time(), "report": text}
        mine = runs.c.robot == robot
        with self._database.writing() as connection:
            new = not connection.execute(sa.delete(runs).where(mine, runs.c.run == name)).rowcount
            connection.execute(sa.insert(runs).values(row))
            newest = sa.select(runs.c.run).where(mine).order_by(runs.c.received.desc(), runs.c.run).limit(KEPT)
            connection.execute(sa.delete(runs).where(mine, runs.c.run.not_in(newest)))
        return name, new

    def of(self, robot: str | None, most: int = KEPT) -> list[dict[str, Any]]:
        """Return the reports of a robot, or of all, the newest first, each with its `robot` and when it was `received`."""
        wanted = sa.select(runs).order_by(runs.c.received.desc(), runs.c.run).limit(most)
        if robot is not None:
            wanted = wanted.where(runs.c.robot == robot)
        with self._database.reading() as connection:
            rows = connection.execute(wanted).all()
        own = [strict_json.loads(row.report, limit=MAX_REPORT) for row in rows]
        return [{**run, "robot": row.robot, "received": row.received} for run, row in zip(own, rows, strict=True)]

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
