"""Drivers of the robot's ports: the fake, and NAOqi with the simulator behind it."""

import json
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fakes.robot import FakeRobot
from rapp_core.config import Config
from rapp_core.ports import Robot
from rapp_core.robot.naoqi import robot as naoqi_robot
from rapp_core.robot.naoqi.connection import Connection

READY = 40.0  # s


@dataclass
class Driver:
    """A robot behind the ports, a folder where it may write, and a person in its room."""

    robot: Robot
    folder: Path
    fake: FakeRobot | None = None
    world: Any = None  # SimWorld

    def person_says(self, text: str) -> None:
        if self.fake is not None:
            self.fake.person_says(text)
            self.fake.body.clock.advance(2.0)
        else:
            self.world.personSay(text, "en-us+f3")

    def wait(self, seconds: float) -> None:
        if self.fake is not None:
            self.fake.body.clock.advance(seconds)
        else:
            time.sleep(seconds)


@pytest.fixture(scope="session")
def simulator(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """URL of a simulated NAO with text-fed ears, and the folder where clients may write."""
    folder = tmp_path_factory.mktemp("nao")
    words = ["--port", "0", "--microphone", "text", "--voice", "silent", "--files", str(folder)]
    with (folder / "nao_sim.log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "rapp_nao_sim", *words],
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            start_new_session=True,
        )
    assert process.stdout is not None
    try:
        assert select.select([process.stdout], [], [], READY)[0], (folder / "nao_sim.log").read_text()
        line = process.stdout.readline()
        assert line.startswith("READY "), line + (folder / "nao_sim.log").read_text()
        yield f"tcp://127.0.0.1:{json.loads(line[6:])['port']}", folder
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(10)
        process.stdout.close()


@pytest.fixture(params=["fake", "naoqi"])
def driver(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Driver]:
    """Both drivers, one after the other."""
    if request.param == "fake":
        fake = FakeRobot()
        yield Driver(fake.robot, tmp_path, fake=fake)
        return
    url, folder = request.getfixturevalue("simulator")
    connection = Connection(url, 5.0)
    robot = naoqi_robot(connection, Config(name="contract"))
    connection.open()
    yield Driver(robot, folder, world=connection.service("SimWorld"))
    connection.close()


@pytest.fixture
def sound(driver: Driver) -> Path:
    """A short sound file that the robot can read."""
    import numpy
    import soundfile

    path = driver.folder / "bell.ogg"
    soundfile.write(path, numpy.zeros(1600, dtype="float32"), 16000, format="OGG", subtype="VORBIS")
    return path
