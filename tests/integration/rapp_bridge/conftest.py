"""One bridge and one rospy node for all tests of a file."""

from collections.abc import Iterator
from typing import Any

import pytest

from fakes.bridge_neighbours import Clients, Peer, node


@pytest.fixture(scope="module")
def peer(ros_env: dict[str, str]) -> Iterator[Peer]:
    with node(ros_env, "peer") as running:
        yield running


@pytest.fixture(scope="module")
def bridge(start_for_module: Any, peer: Peer) -> Any:
    """One bridge for all tests of a file; its clients come and go."""
    return start_for_module("rapp_bridge", "--port", "0", "--call-timeout", "20", "--queue-limit", "4000000", "--linger", "0.5")


@pytest.fixture
def url(bridge: Any) -> str:
    return f"ws://127.0.0.1:{bridge.ready['port']}"


@pytest.fixture
def clients(url: str) -> Clients:
    return Clients(url)
