"""Cloud agents at the platform's own port: who may start, call and stop them, and when they end by themselves (C02 to C08)."""

import asyncio
import os
import signal
import socket
from collections.abc import Awaitable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fakes.cloud_agents import PROBE, until
from fakes.cloud_process import CloudProcess, cloud_process, start
from fakes.packages import source_folder
from fakes.rapps import write_four_agent_rapp, write_rapp
from rapp_hop.client import HopClient
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable


def rapps(folder: Path) -> list[Path]:
    return [
        *write_four_agent_rapp(folder, "probe", "pass", PROBE, ("profile",)),
        *write_four_agent_rapp(folder, "greedy", "pass", PROBE, ("profile", "heartbeat")),
        *write_four_agent_rapp(folder, "broken", "pass", "raise ValueError('on purpose')"),
        write_rapp(folder / "alone", "alone"),
    ]


@pytest.fixture(scope="module")
def cloud(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CloudProcess]:
    folder = tmp_path_factory.mktemp("platform")
    with cloud_process(folder, rapps(folder), agents_of_one=3, lease=1000) as cloud:
        yield cloud


async def failure(call: Awaitable[Any]) -> HopError:
    with pytest.raises(HopError) as caught:
        await call
    return caught.value


async def ended(cloud: CloudProcess) -> None:
    await until(lambda: cloud.agents() == [])


def test_an_agent_is_started_listed_called_and_stopped(cloud: CloudProcess) -> None:
    async def test(nao: HopClient, other: HopClient) -> None:
        agent = await start(nao)
        assert await start(nao) == agent, "one run has one agent"
        assert await nao.call("list_cloud_agents") == {"agents": [{"agent": agent, "rapp": "probe", "run": "r1"}]}
        assert await other.call("list_cloud_agents") == {"agents": []}
        assert (await nao.call(f"agents/{agent}/ask", {"name": "profile"}))["name"] == "nao"
        services = (await nao.call(f"agents/{agent}/available_services"))["services"]
        assert {"ask", "run", "measure"} <= {item["name"] for item in services}
        assert (await nao.call("stop_cloud_agent", {"agent": agent})) == {"stopped": True}
        assert (await nao.call("stop_cloud_agent", {"agent": agent})) == {"stopped": False}
        error = await failure(nao.call(f"agents/{agent}/ask", {"name": "profile"}))
        assert (type(error), error.status) == (Refused, 404)
        assert "it was stopped" in str(error)
        await ended(cloud)

    cloud.run(test)


def test_files_and_errors_pass_both_ways(cloud: CloudProcess, tmp_path: Path) -> None:
    picture = tmp_path / "picture.jpg"
    picture.write_bytes(os.urandom(3_000_000))

    async def test(nao: HopClient, other: HopClient) -> None:
        agent = f"agents/{await start(nao)}"
        assert await nao.call(f"{agent}/measure", {"times": 2}, {"picture": picture}) == {"size": 6_000_000, "ending": ".jpg"}
        assert isinstance(await failure(nao.call(f"{agent}/measure", {"times": "x"}, {"picture": picture})), Invalid)
        assert (await failure(nao.call(f"{agent}/nothing"))).status == 404
        assert isinstance(await failure(nao.call(f"{agent}/run", {"code": "1 / 0"})), Bug)
        for path in ("agents", "agents/", f"{agent}", f"{agent}/../../heartbeat", f"{agent}/a/b"):
            assert isinstance(await failure(nao.call(path)), HopError)
        await nao.call("stop_cloud_agent", {"agent": agent.partition("/")[2]})

    cloud.run(test)


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        (b"application/x-www-form-urlencoded", b'json={"name":"profile"}'),
        (b"application/json; charset=utf-8", b'{"name": "profile"}'),
    ],
)
def test_every_form_of_hop_reaches_the_agent_and_no_token_does(cloud: CloudProcess, kind: bytes, body: bytes) -> None:
    token = (cloud.data / "robots" / "nao.token").read_text()

    async def test(nao: HopClient, other: HopClient) -> None:
        agent = await start(nao)
        reader, writer = await asyncio.open_connection("127.0.0.1", cloud.port)
        writer.write(
            b"POST /hop/agents/%b/ask HTTP/1.1\r\nHost: x\r\nAccept-Token: %b\r\nContent-Type: %b\r\nContent-Length: %d\r\n"
            b"Connection: close\r\n\r\n%b" % (agent.encode(), token.encode(), kind, len(body), body)
        )
        answer = await asyncio.wait_for(reader.read(), 30)
        writer.close()
        assert answer.startswith(b"HTTP/1.1 200") and b'"nao"' in answer
        log = cloud.data / "agents" / "logs" / "probe_cloud.log"
        await nao.call("stop_cloud_agent", {"agent": agent})
        assert token not in log.read_text() and agent not in log.read_text()

    cloud.run(test)


def test_what_cannot_be_started_is_refused_with_the_reason(cloud: CloudProcess) -> None:
    async def test(nao: HopClient, other: HopClient) -> None:
        for rapp, leaf, words in [
            ("nobody", Refused, "no such RApp"),
            ("alone", Refused, "names no partner"),
            ("probe_cloud", Refused, "no such RApp"),
            ("greedy", Refused, "no cloud agent may call heartbeat"),
            ("broken", Bug, "on purpose"),
        ]:
            error = await failure(start(nao, "r9", rapp))
            assert isinstance(error, leaf) and words in str(error), error
        for run in ("", "x" * 200):
            assert isinstance(await failure(start(nao, run)), Refused)
        assert "not registered" in str(await failure(start(other)))
        assert "another robot's" in str(await failure(start(nao, robot="other")))
        assert (await nao.call("list_cloud_agents")) == {"agents": []}
        await ended(cloud)

    cloud.run(test)


def test_c02_a_robot_that_starts_five_hundred_gets_its_quota(cloud: CloudProcess) -> None:
    async def test(nao: HopClient, other: HopClient) -> None:
        answers = await asyncio.gather(*(start(nao, f"r{number}") for number in range(500)), return_exceptions=True)
        started = [answer for answer in answers if isinstance(answer, str)]
        errors = [answer for answer in answers if not isinstance(answer, str)]
        assert len(started) == 3
        assert all(isinstance(error, Refused | Unreachable) for error in errors)
        assert len(cloud.agents()) == 3
        await other.call("register", {"kind": "nao", "api_version": "1.0"})
        mine = await start(other)  # another robot is not kept from its own
        assert (await other.call(f"agents/{mine}/ask", {"name": "profile"}))["name"] == "other"
        for client, agents in ((nao, started), (other, [mine])):
            for agent in agents:
                assert (await client.call("stop_cloud_agent", {"agent": agent}))["stopped"]
        await ended(cloud)

    cloud.run(test)


def test_c03_another_robot_s_agent_can_neither_be_called_nor_stopped(cloud: CloudProcess) -> None:
    async def test(nao: HopClient, other: HopClient) -> None:
        agent = await start(nao)
        error, unknown = await failure(other.call(f"agents/{agent}/run", {"code": "1"})), await failure(other.call("agents/x/run"))
        assert (type(error), error.status, str(error)) == (type(unknown), 404, str(unknown)), "nothing tells that it is there"
        assert await other.call("stop_cloud_agent", {"agent": agent}) == {"stopped": False}
        assert (await nao.call(f"agents/{agent}/ask", {"name": "profile"}))["name"] == "nao"
        await nao.call("stop_cloud_agent", {"agent": agent})

    cloud.run(test)


def test_c01_a_crashed_agent_is_told_and_cleaned_up_and_another_may_be_started(cloud: CloudProcess) -> None:
    async def test(nao: HopClient, other: HopClient) -> None:
        agent = await start(nao)
        error = await failure(nao.call(f"agents/{agent}/run", {"code": "os._exit(3)"}))
        assert (type(error), "crashed" in str(error)) == (Unreachable, True)
        await ended(cloud)
        await until_listed(nao, [])
        error = await failure(nao.call(f"agents/{agent}/run", {"code": "1"}))
        assert (error.status, "it has crashed" in str(error)) == (404, True)
        again = await start(nao)
        assert again != agent
        await nao.call("stop_cloud_agent", {"agent": again})

    cloud.run(test)


async def until_listed(client: HopClient, runs: list[str]) -> None:
    async with asyncio.timeout(30):
        while [each["run"] for each in (await client.call("list_cloud_agents"))["agents"]] != runs:
            await asyncio.sleep(0.05)


def test_c07_agents_take_no_port(cloud: CloudProcess) -> None:
    def listening() -> set[str]:
        lines = Path("/proc/net/tcp").read_text().splitlines() + Path("/proc/net/tcp6").read_text().splitlines()
        return {line.split()[1] for line in lines[1:] if line.split()[3:4] == ["0A"]}

    async def test(nao: HopClient, other: HopClient) -> None:
        agents = [await start(nao, f"r{number}") for number in range(3)]
        inside = "line = socket.socket(); line.bind(('127.0.0.1', 8080)); line.listen(); facts = 8080"
        with socket.socket() as same:
            same.bind(("127.0.0.1", 0))
            before = listening()
            for agent in agents:  # each has all ports for itself, and none is the platform's
                assert await nao.call(f"agents/{agent}/run", {"code": inside}) == 8080
            assert not {place for place in listening() - before if place.endswith(f":{8080:04X}")}
        for agent in agents:
            await nao.call("stop_cloud_agent", {"agent": agent})

    cloud.run(test)


def test_c05_the_agents_of_a_robot_that_disappears_are_gone_with_its_lease(tmp_path: Path) -> None:
    """The lease is 15 s by default; with the look and the end of the processes that is less than the 30 s of DESIGN 3.1."""
    with cloud_process(tmp_path, rapps(tmp_path), lease=4.0) as cloud:

        async def test(nao: HopClient, other: HopClient) -> None:
            agent = await start(nao)
            loop = asyncio.get_running_loop()
            until_ = loop.time() + 6.0  # longer than the lease
            while loop.time() < until_:
                assert (await nao.call("heartbeat"))["registered"]
                await asyncio.sleep(0.2)
            assert len(cloud.agents()) == 1
            await ended(cloud)
            await nao.call("register", {"kind": "nao", "api_version": "1.0"})
            error = await failure(nao.call(f"agents/{agent}/run", {"code": "1"}))
            assert "its robot is silent" in str(error)

        cloud.run(test)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_c06_c08_a_platform_that_dies_leaves_nothing_and_serves_anew(tmp_path: Path, number: int) -> None:
    with cloud_process(tmp_path, rapps(tmp_path), agents_of_one=8) as cloud:

        async def fill(nao: HopClient, other: HopClient) -> None:
            for run in range(6):
                agent = await start(nao, f"r{run}")
                await nao.call(f"agents/{agent}/run", {"code": "if os.fork() == 0: os.setsid(); time.sleep(1000)"})

        async def again(nao: HopClient, other: HopClient) -> None:
            await until_listed(nao, [])
            assert (await failure(nao.call("agents/x/run"))).status == 404
            agent = await start(nao, "r0")
            assert (await nao.call(f"agents/{agent}/ask", {"name": "profile"}))["name"] == "nao"

        cloud.run(fill)
        assert len(cloud.agents()) == 6
        cloud.stop(number)
        cloud.until_nothing_is_left()
        cloud.start()
        cloud.run(again)


def test_a_frozen_agent_is_ended_and_others_are_not_harmed(cloud: CloudProcess) -> None:
    async def test(nao: HopClient, other: HopClient) -> None:
        frozen, well = await start(nao, "r1"), await start(nao, "r2")
        calling = asyncio.create_task(nao.call(f"agents/{frozen}/run", {"code": "os.kill(os.getpid(), signal.SIGSTOP)"}))
        assert (await nao.call(f"agents/{well}/ask", {"name": "profile"}))["name"] == "nao"
        error = await failure(calling)
        assert (type(error), "it hangs" in str(error) or "crashed" in str(error)) == (Unreachable, True)
        await until_listed(nao, ["r2"])
        await nao.call("stop_cloud_agent", {"agent": well})
        await ended(cloud)

    cloud.run(test)


def test_a_store_without_cloud_agents_keeps_no_spare(tmp_path: Path) -> None:
    with cloud_process(tmp_path, [source_folder(tmp_path)]) as cloud:

        async def test(nao: HopClient, other: HopClient) -> None:
            assert [each["name"] for each in (await nao.call("list_rapps"))["rapps"]] == ["hello"]

        cloud.run(test)
        assert cloud.left() == []
