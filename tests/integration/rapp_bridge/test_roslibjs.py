"""The bridge with roslibjs, unchanged: each story of the folder roslibjs is a program for node, and judges itself."""

import asyncio
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fakes.bridge_neighbours import PATIENCE, Peer
from fakes.bridge_workshop import workshop
from fakes.roslibjs import ENV, NODE, install_roslib


@pytest.fixture(scope="session")
def roslibjs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install_roslib(tmp_path_factory.mktemp("npm") / "roslibjs")


@pytest.fixture(scope="module")
def _workshop(ros_env: dict[str, str]) -> Iterator[None]:
    with workshop(ros_env):
        yield


@contextmanager
def told(folder: Path, name: str, url: str) -> Iterator["subprocess.Popen[str]"]:
    """A running story; it has to end well by itself."""
    words = [str(NODE), name, url]
    pipe = subprocess.PIPE
    process = subprocess.Popen(words, cwd=folder, env=ENV, stdin=pipe, stdout=pipe, stderr=pipe, text=True)
    try:
        yield process
        _, errors = process.communicate("on\n", timeout=3 * PATIENCE)
        assert process.returncode == 0, errors
    finally:
        process.kill()
        process.communicate()


@pytest.mark.usefixtures("_workshop")
@pytest.mark.parametrize("name", ["topics.mjs", "rosapi.mjs", "actions.mjs"])
def test_roslibjs_with(roslibjs: Path, url: str, peer: Peer, name: str) -> None:
    with told(roslibjs, name, url):
        pass


def test_roslibjs_with_services(roslibjs: Path, url: str, peer: Peer) -> None:
    def answer(service: str, text: str) -> str:
        peer.call(service, text)
        return asyncio.run(peer.heard())

    with told(roslibjs, "services.mjs", url) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "offering\n"
        assert answer("/from_roslibjs", "loud") == "LOUD"
        assert answer("/from_roslibjs_later", "now") == "now later"
        assert answer("/from_roslibjs", "false").startswith("error: ")
        assert "out of breath" in answer("/from_roslibjs_later", "throw")
