"""Settings of `robot`: one frozen object, from environment, then options."""

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import platformdirs


@dataclass(frozen=True)
class RobotConfig:
    """Which processes to start, and how."""

    home: Path  # the robot's data folder
    name: str  # of the robot, at the platform
    robot: str | None  # URL of a real robot's NAOqi; None: start the simulator
    core: tuple[str, ...]  # further options of the core agent
    sim: tuple[str, ...]  # further options of the simulator
    bridge_port: int = 0  # of rosbridge; 0: any free one
    master_port: int = 0  # of the ROS master; 0: any free one
    ready: float = 40.0  # s for one process to become ready
    end: float = 6.0  # s from SIGTERM to SIGKILL


def read(words: Sequence[str], env: Mapping[str, str] = os.environ) -> RobotConfig:
    """Build the configuration; ends the program with usage for wrong options."""
    parser = argparse.ArgumentParser(prog="robot", description="all processes of one robot; the link's settings: link --help")
    home = env.get("RAPP_HOME") or platformdirs.user_data_dir("rapp")
    parser.add_argument("--home", type=Path, default=home, help="the robot's data folder [RAPP_HOME] (%(default)s)")
    parser.add_argument("--name", default=env.get("RAPP_ROBOT_NAME", "nao"), help="the robot's name [RAPP_ROBOT_NAME]")
    parser.add_argument("--robot", default=env.get("RAPP_ROBOT"), help="NAOqi of a real robot; without it: the simulator")
    parser.add_argument("--config", type=Path, help="settings of the core agent")
    parser.add_argument("--bridge-port", type=int, default=0, help="of rosbridge; 0: any free one")
    parser.add_argument("--master-port", type=int, default=0, help="of the ROS master; 0: any free one")
    parser.add_argument("--microphone", choices=("sound", "text"), default="sound", help="of the simulator")
    parser.add_argument("--voice", choices=("espeak", "silent"), default="espeak", help="of the simulator")
    parser.add_argument("--no-world", action="store_true", help="simulate voice and ears only")
    options = parser.parse_args(words)
    sim = ["--microphone", options.microphone, "--voice", options.voice]
    return RobotConfig(
        home=options.home.expanduser().resolve(),
        name=options.name,
        robot=options.robot or None,
        core=("--config", str(options.config)) if options.config else (),
        sim=(*sim, "--no-world") if options.no_world else tuple(sim),
        bridge_port=options.bridge_port,
        master_port=options.master_port,
    )
