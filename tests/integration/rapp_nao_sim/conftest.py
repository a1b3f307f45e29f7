"""Simulated robots as processes, and clients as they are written for a real NAO: libqi, nothing else."""

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi logs on standard output otherwise

import qi

from fakes.processes import children, ended

READY = 30.0  # s
PATIENCE = 20.0  # s


class Simulator:
    """A running nao_sim; `session` is a client's."""

    def __init__(self, words: tuple[str, ...], log: Path) -> None:
        self.log = log
        with log.open("wb") as errors:
            command = [sys.executable, "-m", "rapp_nao_sim", *words]
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, start_new_session=True)
        assert self.process.stdout is not None
        assert select.select([self.process.stdout], [], [], READY)[0], log.read_text()
        line = self.process.stdout.readline()
        assert line.startswith("READY "), log.read_text()
        self.port = json.loads(line[6:])["port"]
        self.children = children(self.process.pid)
        self.session = qi.Session()
        self.session.connect(f"tcp://127.0.0.1:{self.port}")

    def service(self, name: str) -> Any:
        return self.session.service(name)

    def end(self, number: int = signal.SIGTERM) -> int:
        self.session.close()
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(10)
        finally:
            self.process.kill()
            assert self.process.stdout is not None
            self.process.stdout.close()


@pytest.fixture(name="gone", scope="session")
def _gone() -> Callable[[int], bool]:
    return ended


@pytest.fixture(name="children", scope="session")
def _children() -> Callable[[int], list[int]]:
    return children


@pytest.fixture(scope="session")
def wait_for() -> Callable[..., None]:
    def wait(condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, "it did not happen"
            time.sleep(0.01)

    return wait


Simulate = Callable[..., Simulator]


@contextmanager
def _simulating(folder: Path) -> Iterator[Simulate]:
    begun: list[Simulator] = []

    def simulate(*words: str) -> Simulator:
        words = ("--port", "0", "--files", str(folder), *words)
        begun.append(Simulator(words, folder / f"nao_sim{len(begun)}.log"))
        return begun[-1]

    yield simulate
    for each in begun:
        each.end()


@pytest.fixture
def simulate(tmp_path: Path) -> Iterator[Simulate]:
    """Starts simulators with words; all are ended after the test."""
    with _simulating(tmp_path) as start:
        yield start


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where clients may write."""
    return tmp_path_factory.mktemp("nao")


@pytest.fixture(scope="module")
def texted(folder: Path) -> Iterator[Simulator]:
    """A robot that hears text and speaks silently, without body."""
    with _simulating(folder) as start:
        yield start("--microphone", "text", "--voice", "silent", "--no-world")


@pytest.fixture(scope="module")
def sounding(folder: Path) -> Iterator[Simulator]:
    """A robot that hears and speaks by sound, without body."""
    with _simulating(folder) as start:
        yield start("--no-world")


@pytest.fixture(scope="module")
def bodied(folder: Path) -> Iterator[Simulator]:
    """A robot in the room `seen.toml`, before things to look at, that hears text and speaks silently."""
    with _simulating(folder) as start:
        yield start("--microphone", "text", "--voice", "silent", "--room", str(Path(__file__).with_name("seen.toml")))


@pytest.fixture(scope="module")
def bare(folder: Path) -> Iterator[Simulator]:
    """A robot on a wide floor before a wall, that hears text and speaks silently."""
    room = Path(__file__).parents[1] / "rapp_nao_sim_world" / "bare.toml"
    with _simulating(folder) as start:
        yield start("--microphone", "text", "--voice", "silent", "--room", str(room))


@pytest.fixture(scope="session")
def failing() -> Callable[..., Any]:
    """A call that must fail, with NAOqi's form of an error: "Module::method", below it what is wrong, no Python traceback."""

    @contextmanager
    def failing_call(method: str, match: str) -> Iterator[None]:
        with pytest.raises(RuntimeError) as caught:
            yield
        text = str(caught.value)
        assert text.startswith(f"{method}\n\t"), text
        assert match in text, text
        assert "At:" not in text

    return failing_call


@pytest.fixture
def memory(texted: Simulator) -> Any:
    return texted.service("ALMemory")


@pytest.fixture
def tts(texted: Simulator) -> Any:
    return texted.service("ALTextToSpeech")


@pytest.fixture
def events(memory: Any) -> Iterator[Callable[..., list[tuple[str, Any]]]]:
    """Collects what is raised for keys."""
    links: list[tuple[Any, int]] = []

    def collect(*keys: str) -> list[tuple[str, Any]]:
        raised: list[tuple[str, Any]] = []
        for key in keys:
            subscriber = memory.subscriber(key)
            links.append((subscriber, subscriber.signal.connect(lambda value, key=key: raised.append((key, value)))))
        return raised

    yield collect
    for subscriber, link in links:
        subscriber.signal.disconnect(link)


@pytest.fixture
def device(texted: Simulator) -> Iterator[Any]:
    module = texted.service("ALAudioDevice")
    yield module
    module.unsubscribe("Samples")
