"""A platform in service: health, metrics, and what operations do to it (O01 to O09), each with a real process."""

import asyncio
import json
import signal
import sqlite3
import time
import urllib.error
import urllib.request
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest
import sqlalchemy as sa

from fakes import postgres as pg
from fakes.cloud_process import CloudProcess, cloud_process
from fakes.whole_robot import processes_of
from rapp_cloud.database.engine import FILE, Database
from rapp_cloud.health import _Kept
from rapp_cloud.memory import open_memory
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Unreachable
from rapp_hop.protocol import WireAnswer

PATIENCE = 30.0  # s


@pytest.fixture
def cloud(tmp_path: Path) -> Iterator[CloudProcess]:
    with cloud_process(tmp_path, []) as cloud:
        yield cloud


@pytest.fixture(scope="module")
def steady(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CloudProcess]:
    """One for the tests that leave it as it was."""
    with cloud_process(tmp_path_factory.mktemp("steady"), []) as cloud:
        yield cloud


def _get(cloud: CloudProcess, path: str, **headers: str) -> tuple[int, str]:
    request = urllib.request.Request(f"http://127.0.0.1:{cloud.port}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode()


async def _until(true: Callable[[], Awaitable[bool]]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not await true():
        assert time.monotonic() < deadline
        await asyncio.sleep(0.05)


def test_health_and_metrics(steady: CloudProcess) -> None:
    async def robot(nao: HopClient, other: HopClient) -> None:
        await nao.call("heartbeat")
        with pytest.raises(HopError):
            await other.call("list_rapps")
        with pytest.raises(HopError):
            await nao.call("nothing_of_ours")

    steady.run(robot)
    assert _get(steady, "/healthz") == (200, '{"alive": true}')
    assert _get(steady, "/readyz") == (200, '{"ready": true, "reasons": []}')
    assert _get(steady, "/healthz/x")[0] == 404
    status, text = _get(steady, "/metrics")
    assert status == 200
    lines = text.splitlines()
    assert 'rapp_calls_total{service="heartbeat",status="200"} 1.0' in lines
    assert 'rapp_calls_total{service="list_rapps",status="403"} 1.0' in lines
    assert 'rapp_calls_total{service="other",status="404"} 1.0' in lines
    assert 'rapp_call_seconds_count{service="heartbeat"} 1.0' in lines
    assert {"rapp_robots 1.0", "rapp_cloud_agents 0.0"} <= set(lines)
    assert "nothing_of_ours" not in text


def test_metrics_are_not_for_everybody(steady: CloudProcess) -> None:
    token = (steady.data / "robots" / "nao.token").read_text()
    proxied = {"X-Forwarded-For": "192.0.2.1"}
    assert _get(steady, "/metrics", **proxied)[0] == 401
    assert _get(steady, "/metrics", **proxied, **{"Accept-Token": "x" * 43})[0] == 401
    assert _get(steady, "/metrics", **proxied, **{"Accept-Token": token})[0] == 200
    assert _get(steady, "/healthz", **proxied)[0] == 200


def test_o01_a_locked_database_holds_up_nobody_else(steady: CloudProcess) -> None:
    async def test(nao: HopClient, _other: HopClient) -> None:
        lock = sqlite3.connect(steady.data / FILE, isolation_level=None)
        lock.execute("BEGIN IMMEDIATE")
        waiting = asyncio.create_task(nao.call("report", {"run": {"run": "r-1"}}, timeout=PATIENCE))
        assert (await nao.call("heartbeat"))["registered"]
        assert (await nao.call("list_rapps")) == {"rapps": []}
        assert not waiting.done()
        with pytest.raises(Unreachable, match="try again later"):
            await waiting
        status, text = await asyncio.to_thread(_get, steady, "/readyz")
        assert (status, json.loads(text)["ready"]) == (503, False)
        assert "database" in text
        lock.close()

        async def ready() -> bool:
            return (await asyncio.to_thread(_get, steady, "/readyz"))[0] == 200

        await _until(ready)
        assert await nao.call("report", {"run": {"run": "r-1"}}, timeout=PATIENCE) == {"kept": True}

    steady.run(test)


def test_o01_a_damaged_database_is_said_at_start(cloud: CloudProcess) -> None:
    cloud.stop()
    for path in cloud.data.glob(f"{FILE}-*"):
        path.unlink()
    (cloud.data / FILE).write_bytes(b"no database at all" * 1000)
    with pytest.raises(AssertionError, match=r"cannot use the database.*restore a back-up"):
        cloud.start()
    assert "Traceback" not in cloud.log.read_text()
    assert cloud.stop() == 1


def test_o02_a_full_log_disk_stops_nothing(tmp_path: Path) -> None:
    cloud = CloudProcess(tmp_path, [])
    cloud.log = Path("/dev/full")
    cloud.start()
    try:

        async def test(nao: HopClient, other: HopClient) -> None:
            for number in range(20):
                with pytest.raises(HopError):
                    await other.call("list_rapps")  # each is logged
                await nao.call("report", {"run": {"run": f"r-{number}"}})

        cloud.run(test)
    finally:
        assert cloud.stop() == 0


def test_o05_an_upgrade_keeps_tokens_leases_and_reports(tmp_path: Path) -> None:
    """A folder of the first version, with files of before there was a database; the robot goes on as if nothing was."""
    cloud = CloudProcess(tmp_path, [])
    for path in cloud.data.glob(f"{FILE}*"):
        path.unlink()
    database = Database(f"sqlite:///{cloud.data / FILE}")
    database.migrate("0001")
    with database.writing() as connection:
        until = time.time() + 3600
        connection.execute(sa.text("INSERT INTO robots VALUES ('nao', 'nao', '1.0', :until)"), {"until": until})
    database.close()
    tokens = {(cloud.data / "robots" / f"{robot}.token").read_text(): robot for robot in ("nao", "other")}
    (cloud.data / "tokens.json").write_text(json.dumps(tokens))
    (cloud.data / "reports" / "nao").mkdir(parents=True)
    (cloud.data / "reports" / "nao" / "r-1.json").write_text('{"run": "r-1"}')
    cloud.start()
    try:

        async def old_robot() -> None:
            client = HopClient(f"http://127.0.0.1:{cloud.port}", next(iter(tokens)))
            try:
                assert (await client.call("heartbeat"))["registered"]
                assert await client.call("list_rapps") == {"rapps": []}
                assert await client.call("report", {"run": {"run": "r-2"}}) == {"kept": True}
            finally:
                await client.close()

        asyncio.run(old_robot())
    finally:
        assert cloud.stop() == 0
    assert not (cloud.data / "tokens.json").exists()
    with open_memory(cloud.data) as memory:
        assert [run["run"] for run in memory.reports.of("nao")] == ["r-2", "r-1"]


def test_leases_outlive_a_kill(cloud: CloudProcess) -> None:
    async def written(nao: HopClient, _other: HopClient) -> None:
        def row() -> bool:
            with sqlite3.connect(cloud.data / FILE) as connection:
                return connection.execute("SELECT count(*) FROM robots WHERE name = 'nao'").fetchone() == (1,)

        await _until(lambda: asyncio.to_thread(row))

    cloud.run(written)
    cloud.stop(signal.SIGKILL)
    cloud.start()

    async def again() -> None:
        client = HopClient(f"http://127.0.0.1:{cloud.port}", (cloud.data / "robots" / "nao.token").read_text())
        try:
            assert (await client.call("heartbeat"))["registered"]
        finally:
            await client.close()

    asyncio.run(again())


def test_o06_sigterm_under_load_drains(cloud: CloudProcess) -> None:
    """Every call is answered whole or not taken; what was answered is kept."""

    async def report(nao: HopClient, name: str) -> str | None:
        try:
            await nao.call("report", {"run": {"run": name}}, timeout=PATIENCE)
        except Unreachable:
            return None
        return name

    kept: list[str] = []

    async def test(nao: HopClient, _other: HopClient) -> None:
        calls = [asyncio.create_task(report(nao, f"r-{number}")) for number in range(60)]
        await asyncio.wait(calls, return_when=asyncio.FIRST_COMPLETED)
        ended = asyncio.create_task(asyncio.to_thread(cloud.stop))
        kept.extend(name for name in await asyncio.gather(*calls) if name)
        assert await ended == 0

    cloud.run(test)
    assert kept
    with open_memory(cloud.data) as memory:
        assert {run["run"] for run in memory.reports.of("nao")} >= set(kept)


def test_o08_metrics_scraped_all_the_time(steady: CloudProcess) -> None:
    async def test(nao: HopClient, _other: HopClient) -> None:
        scrapes = [asyncio.create_task(asyncio.to_thread(_get, steady, "/metrics")) for _ in range(300)]
        for _ in range(20):
            assert (await nao.call("heartbeat"))["registered"]
        assert {status for status, _ in await asyncio.gather(*scrapes)} == {200}

    steady.run(test)


def test_o08_an_answer_is_made_once_for_all_who_ask() -> None:
    made: list[int] = []

    async def make() -> WireAnswer:
        made.append(1)
        await asyncio.sleep(0)
        return WireAnswer(200, "text/plain", b"x")

    async def main() -> None:
        kept = _Kept(make)
        assert {answer.body for answer in await asyncio.gather(*(kept() for _ in range(100)))} == {b"x"}

    asyncio.run(main())
    assert len(made) == 1


def test_o09_secrets_are_in_no_log_no_argv_no_child_and_no_core(tmp_path: Path, postgres: str) -> None:
    with pg.database(postgres, "secret") as url:
        secret = "geheim-7f3a-0123456789"
        url = url.replace("rapp@", f"rapp:{secret}@")
        cloud = CloudProcess(tmp_path, [], database=url, passphrase=secret)
        cloud.start()
        try:
            cloud.run(_talk)
            token = (cloud.data / "robots" / "nao.token").read_text()
            processes = _family(cloud.pid)
            assert len(processes) > 1
            for process in processes:
                words = Path(f"/proc/{process}/cmdline").read_bytes().decode("utf-8", "replace")
                assert secret not in words and token not in words
                if process != cloud.pid:
                    assert secret not in Path(f"/proc/{process}/environ").read_bytes().decode("utf-8", "replace")
            limits = Path(f"/proc/{cloud.pid}/limits").read_text().splitlines()
            assert next(line for line in limits if line.startswith("Max core file size")).split()[4:6] == ["0", "0"]
        finally:
            assert cloud.stop() == 0
        log = cloud.log.read_text()
        assert log and secret not in log and token not in log
        assert processes_of(tmp_path) == []


async def _talk(nao: HopClient, other: HopClient) -> None:
    await nao.call("report", {"run": {"run": "r-1"}})
    for call in (other.call("list_rapps"), nao.call("nothing"), nao.call("report", {"run": 3})):
        with pytest.raises(HopError):
            await call


def _family(pid: int) -> list[int]:
    found: list[int] = [pid]
    for parent in found:
        for task in Path(f"/proc/{parent}/task").glob("*/children"):
            found.extend(int(word) for word in task.read_text().split())
    return found


def test_the_platform_runs_on_postgresql(tmp_path: Path, postgres: str) -> None:
    """And goes on when the server has been away."""
    with pg.database(postgres, "platform") as url:
        with cloud_process(tmp_path, [], database=url) as cloud:
            assert not (cloud.data / FILE).exists()

            async def test(nao: HopClient, _other: HopClient) -> None:
                await nao.call("report", {"run": {"run": "r-1"}})
                engine = sa.create_engine(postgres.format("postgres"), isolation_level="AUTOCOMMIT")
                with engine.connect() as connection:
                    connection.execute(sa.text("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = 'platform'"))
                engine.dispose()
                await nao.call("report", {"run": {"run": "r-2"}})
                assert await asyncio.to_thread(_get, cloud, "/readyz") == (200, '{"ready": true, "reasons": []}')

            cloud.run(test)
        with open_memory(cloud.data, url) as memory:
            assert [run["run"] for run in memory.reports.of("nao")] == ["r-2", "r-1"]
