"""All that a platform keeps in its database: opened, brought up to date, kept in step while it serves, closed."""

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path

from rapp_cloud.accounts import Accounts
from rapp_cloud.admission import Admission
from rapp_cloud.audit import Audit
from rapp_cloud.database.engine import FILE, Database
from rapp_cloud.people import People
from rapp_cloud.quotas import Quotas
from rapp_cloud.registrations import Registrations
from rapp_cloud.reports import Reports
from rapp_cloud.robots import Robots
from rapp_hop.errors import Bug, HopError, Unreachable

STEP = 0.5  # seconds in which the process sees what a command has changed, and in which leases and counts are written
OVERDUE = 30.0  # seconds after which a platform is not ready that has not done a whole step; a locked database takes 5 a try
_log = logging.getLogger(__name__)


class Memory:
    """The parts that share one database."""

    def __init__(self, database: Database, folder: Path) -> None:
        self.database = database
        self.accounts = Accounts(database)
        self.admission = Admission(self.accounts)
        self.people = People(self.accounts)
        self.quotas = Quotas(database)
        self.audit = Audit(database, folder)
        self.reports = Reports(database)
        self._stepped = time.monotonic()

    def stepped(self) -> None:
        """Remember that all is in step with the database now."""
        self._stepped = time.monotonic()

    def check(self) -> None:
        """Look whether what is known from memory is still that of the database.

        :raises Unreachable: when it has not been in step for too long
        """
        since = time.monotonic() - self._stepped
        if since > OVERDUE:
            raise Unreachable(
                f"cannot keep accounts, leases and audit log in step with the database for {since:.0f} s: see the log"
            )


@contextmanager
def open_memory(data: Path, url: str | None = None) -> Iterator[Memory]:
    """Open a platform's database and bring it up to date, with what older platforms kept in files. Blocking.

    :param url: None: SQLite in the data folder
    :raises HopError: when it cannot be used
    """
    memory = _open(data, url)
    try:
        yield memory
    finally:
        memory.database.close()


@asynccontextmanager
async def remembering(data: Path, url: str | None, robots: Robots) -> AsyncIterator[Memory]:
    """`open_memory` for a process that serves: tokens, people, leases, quotas stay in step with the database meanwhile."""
    memory = await asyncio.to_thread(_open, data, url)
    registrations, stop = Registrations(memory.database, robots), asyncio.Event()
    try:
        await asyncio.to_thread(registrations.load)
        await asyncio.to_thread(memory.quotas.load)
        stepping = asyncio.create_task(_keep_in_step(memory, registrations, stop))
        try:
            yield memory
        finally:
            stop.set()
            await stepping
    finally:
        await asyncio.to_thread(memory.database.close)


def url_of(data: Path, url: str | None) -> str:
    """Return the URL of a platform's database: the one it was given, or SQLite in its data folder."""
    return url or f"sqlite:///{(data / FILE).absolute()}"


def _open(data: Path, url: str | None) -> Memory:
    memory = Memory(Database(url_of(data, url)), data)
    try:
        memory.database.migrate()
        memory.accounts.adopt(data / "tokens.json")
        memory.reports.adopt(data / "reports")
        memory.people.adopt(data / "profiles")
        memory.accounts.refresh()
        memory.people.refresh()
    except BaseException:
        memory.database.close()
        raise
    return memory


async def _keep_in_step(memory: Memory, registrations: Registrations, stop: asyncio.Event) -> None:
    """Do a step now and then, and one at the end."""
    well = True
    while not stop.is_set():
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(stop.wait(), STEP)
        error = await _step(memory, registrations)
        if error is None:
            memory.stepped()
        elif well:  # said once, not at every step
            bug = error if isinstance(error, Bug) or not isinstance(error, HopError) else None
            _log.error("%s; tokens, people and leases are those of before meanwhile", error, exc_info=bug)
        well = error is None


async def _step(memory: Memory, registrations: Registrations) -> Exception | None:
    """Do all of a step that can be done; return what was wrong."""
    wrong: Exception | None = None
    steps = (memory.accounts.refresh, memory.people.refresh, registrations.write, memory.quotas.write, memory.audit.write)
    for step in steps:
        try:
            await asyncio.to_thread(step)
        except Unreachable as error:
            return error  # the next one would fare no better
        except Exception as error:  # noqa: BLE001 (one fault must not end the platform's bookkeeping)
            wrong = wrong or error
    return wrong
