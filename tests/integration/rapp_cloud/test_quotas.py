"""Calls of a day outlive the process that has counted them, on both databases."""

import signal
import time
from pathlib import Path

import pytest
import sqlalchemy as sa

from fakes.cloud_process import CloudProcess
from rapp_cloud.database.engine import Database
from rapp_cloud.database.tables import calls
from rapp_cloud.memory import open_memory
from rapp_cloud.quotas import DAY, Quotas
from rapp_hop.client import HopClient
from rapp_hop.errors import Unreachable

PATIENCE = 30.0  # s
NOON = 20_000.5 * DAY


class Clock:
    now = NOON

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def _calls(quotas: Quotas, token: str, quota: int) -> int:
    """Call until it is one too many; gives how many were served."""
    for count in range(quota + 1):
        try:
            quotas.count(token, quota)
        except Unreachable as error:
            assert error.status == 429
            return count
    raise AssertionError("it is never too much")


def _rows(database: Database) -> list[tuple[str, int, int]]:
    with database.reading() as connection:
        return [tuple(row) for row in connection.execute(sa.select(calls).order_by(calls.c.token))]


def test_counts_go_on_where_they_were(database: Database, clock: Clock) -> None:
    first = Quotas(database, clock)
    for _ in range(3):
        first.count("a", 10)
    first.count("b", 1)
    first.write()
    first.write()
    assert _rows(database) == [("a", 20_000, 3), ("b", 20_000, 1)]
    assert _calls(first, "a", 5) == 2
    later = Quotas(database, clock)  # what the first has not written is lost
    later.load()
    assert _calls(later, "b", 1) == 0
    assert _calls(later, "a", 10) == 7
    later.write()
    assert _rows(database) == [("a", 20_000, 10), ("b", 20_000, 1)]


def test_a_call_too_many_is_not_counted(database: Database, clock: Clock) -> None:
    quotas = Quotas(database, clock)
    for _ in range(20):
        assert _calls(quotas, "a", 2) in (0, 2)
    quotas.write()
    assert _rows(database) == [("a", 20_000, 2)]
    quotas.count("a", 3)  # who is given more has the rest of it


def test_a_new_day_begins_from_nothing(database: Database, clock: Clock) -> None:
    quotas = Quotas(database, clock)
    assert _calls(quotas, "a", 4) == 4
    quotas.write()
    with pytest.raises(Unreachable) as caught:
        quotas.count("a", 4)
    clock.now += (caught.value.retry_after or 0) - 2
    assert _calls(quotas, "a", 4) == 0
    clock.now += 2
    quotas.count("a", 4)
    quotas.write()
    assert _rows(database) == [("a", 20_001, 1)]
    clock.now += DAY
    later = Quotas(database, clock)
    later.load()
    assert _calls(later, "a", 4) == 4


def test_two_processes_add_to_the_same_numbers(database: Database, clock: Clock) -> None:
    one, two = Quotas(database, clock), Quotas(database, clock)
    for quotas in (one, two, one):
        quotas.count("a", 10)
        quotas.write()
    assert _rows(database) == [("a", 20_000, 3)]


def test_what_a_locked_database_did_not_take_is_written_later(database: Database, database_url: str, clock: Clock) -> None:
    other = Database(database_url, wait=0.2)
    quotas = Quotas(other, clock)
    quotas.count("a", 2)
    with database.writing() as connection:
        if database.server:
            connection.execute(sa.text("LOCK TABLE calls IN ACCESS EXCLUSIVE MODE"))
        with pytest.raises(Unreachable):
            quotas.write()
        quotas.count("a", 2)  # served, and bounded, meanwhile
        with pytest.raises(Unreachable, match="2 calls a day"):
            quotas.count("a", 2)
    quotas.write()
    assert _rows(database) == [("a", 20_000, 2)]
    other.close()


def _today(database: Database) -> int:
    return sum(count for _, day, count in _rows(database) if day == int(time.time() // DAY))


def test_a_killed_platform_goes_on_counting(database: Database, database_url: str, tmp_path: Path) -> None:
    cloud = CloudProcess(tmp_path, [], database=database_url)
    for _ in range(2):
        day = time.time() // DAY
        try:
            _kill_and_go_on(cloud, database, database_url)
            return
        except (AssertionError, pytest.fail.Exception):
            if time.time() // DAY == day:
                raise  # else midnight (UTC) came in between, and counts began anew
        finally:
            cloud.stop()
    raise AssertionError("two days have ended")


def _kill_and_go_on(cloud: CloudProcess, database: Database, url: str) -> None:
    with open_memory(cloud.data, url) as memory:
        (cloud.data / "robots" / "nao.token").write_text(memory.accounts.give("nao", quota=5))

    async def three(nao: HopClient, _other: HopClient) -> None:  # with the registration
        for _ in range(2):
            await nao.call("heartbeat")

    async def one_more(nao: HopClient, _other: HopClient) -> None:
        await nao.call("heartbeat")
        with pytest.raises(Unreachable, match="5 calls a day"):
            await nao.call("heartbeat")

    cloud.start()
    cloud.run(three)
    deadline = time.monotonic() + PATIENCE
    while _today(database) != 3:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    cloud.stop(signal.SIGKILL)
    cloud.start()
    try:
        cloud.run(one_more)
    except Unreachable as error:
        raise AssertionError(str(error)) from error
    assert cloud.stop() == 0
    assert _today(database) == 5
