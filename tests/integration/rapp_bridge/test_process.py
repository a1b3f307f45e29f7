"""The bridge as a process: it starts and ends."""

import asyncio
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fakes.bridge_neighbours import Clients, Peer
from rapp_ros.master import ask

STARTER = Path(__file__).parents[3] / "catkin_ws/src/rapp_core/scripts/rosbridge"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_cleanly_with_calls_open_both_ways(start: Any, peer: Peer, number: int) -> None:
    bridge = start("rapp_bridge", "--port", "0", env={"ROS_NAMESPACE": "/ending"})

    async def story() -> None:
        async with Clients(f"ws://127.0.0.1:{bridge.ready['port']}") as clients:
            socket, provider = await clients.new(), await clients.new()
            await provider.send(op="advertise_service", service="/ending", type="rapp_msgs/Say")
            await provider.settle()
            await socket.send(op="call_service", service="/ending")
            peer.call("/ending", "from ROS")
            for _ in range(2):
                await provider.receive("call_service")
            assert await asyncio.to_thread(bridge.stop, number) == 0
            assert (await peer.heard()).startswith("error")

    asyncio.run(story())


def test_a_guest_serves_its_clients_and_offers_nothing_of_its_own(start: Any, peer: Peer, ros_env: dict[str, str]) -> None:
    types = ["--service-type", "rapp_msgs/Say", "--service-type", "rapp_msgs/NotThere"]
    bridge = start("rapp_bridge", "--port", "0", "--guest", *types, env={"ROS_NAMESPACE": "/guest"})

    async def story() -> None:
        async with Clients(f"ws://127.0.0.1:{bridge.ready['port']}") as clients:
            socket = await clients.new()
            await socket.send(op="call_service", service="/say", args={"text": "hello"})
            assert (await socket.receive("service_response"))["values"]["message"] == "hello"

    asyncio.run(story())
    publishers, subscribers, services = ask(ros_env["ROS_MASTER_URI"], 10.0, "getSystemState", "/test")[2]
    assert [topic for topic, nodes in [*publishers, *subscribers] if "/guest/rosbridge" in nodes] == []
    offered = {name for name, nodes in services if "/guest/rosbridge" in nodes}
    assert offered == {"/guest/rosbridge/get_loggers", "/guest/rosbridge/set_logger_level"}


def test_it_ends_while_it_waits_for_a_master(ros_env: dict[str, str]) -> None:
    env = {**ros_env, "ROS_MASTER_URI": "http://127.0.0.1:9"}
    process = subprocess.Popen([sys.executable, "-m", "rapp_bridge", "--port", "0"], env=env, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    try:
        while "waits for the ROS master" not in process.stderr.readline():
            assert process.poll() is None
        process.terminate()
        assert process.wait(10) == 0
    finally:
        process.kill()
        process.communicate()


def test_the_starter_runs_from_anywhere(tmp_path: Path) -> None:
    link = tmp_path / "bridge"
    link.symlink_to(STARTER)
    done = subprocess.run(
        [link, "--help"], cwd="/", env={"PATH": os.environ["PATH"]}, capture_output=True, text=True, timeout=30, check=True
    )
    assert "--call-timeout" in done.stdout


@pytest.mark.parametrize("words", [["--call-timeout", "0"], ["--port", "x"], ["--nonsense"]])
def test_wrong_options_are_refused(words: list[str], ros_env: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "rapp_bridge", *words], env=ros_env, capture_output=True, text=True, timeout=30, check=False
    )
    assert done.returncode == 2
    assert words[0] in done.stderr
