"""Settings of the core agent: one frozen object, from a file, then environment, then options."""

import argparse
import math
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import platformdirs

from rapp_core.errors import Invalid


@dataclass(frozen=True)
class Limits:
    """What one dynamic agent may use (DESIGN section 3.6)."""

    memory: int = 1 << 30  # bytes of address space
    cpu: int = 600  # s of processor time
    processes: int = 64  # processes and threads
    files: int = 256  # open files
    file_size: int = 64 << 20  # bytes of one file
    private: int = 64 << 20  # bytes of all files in its private folder, in memory
    kept: int = 64 << 20  # bytes of all files the RApp has the core agent keep, of all its runs
    kept_file: int = 8 << 20  # bytes of one of them
    sent: int = 16 << 20  # bytes of the files handed over with one call


@dataclass(frozen=True)
class Config:
    """Every setting and bound of the core agent."""

    robot: str = "tcp://127.0.0.1:9559"  # NAOqi
    home: Path = field(default_factory=lambda: platformdirs.user_data_path("rapp"))  # $RAPP_HOME
    name: str = "nao"  # of this robot, at the platform
    kind: str = "nao"
    language: str = "en"  # of the person
    threshold: float = 0.4  # probability below which a word counts as unrecognised (paper section V.A.2)
    stop_threshold: float = 0.5  # probability from which the word that stops the robot counts; a wrong one ends a RApp
    recognise_timeout: float = 8.0  # s that rapp_recognize listens unless told otherwise
    long_command: float = 1.4  # s; a longer sound that is no keyword is a long command; includes the detector's hang-over
    longest_keyword: float = 2.5  # s; a longer sound is no isolated keyword, whatever the recogniser makes of it
    longest_command: float = 30.0  # s; what goes on longer is taken as it is
    end_of_command: float = 0.2  # s of quiet that end a long command, after the detector's own hang-over
    verdict: float = 0.8  # s the recogniser may take after the end of a sound that could be a keyword
    listening_round: float = 10.0  # s after which a quiet listening round, and its recording, start anew
    naoqi_timeout: float = 5.0  # s for calls of NAOqi that return at once
    register_timeout: float = 4.0  # s
    register_again: float = 5.0  # s between tries while the platform is away
    catalogue_again: float = 60.0  # s between looks at the platform's catalogue
    interpret_timeout: float = 30.0  # s
    install_timeout: float = 60.0  # s
    cloud_agent_start: float = 10.0  # s for the platform to start a RApp's cloud agent
    cloud_agent_stop: float = 3.0  # s that a dynamic agent waits for its end; the core agent itself waits a third of it
    cloud_call_timeout: float = 30.0  # s for a dynamic agent's cloud call unless told otherwise
    mail_timeout: float = 60.0  # s
    link_back: float = 15.0  # s from a mail's first try in which a link that is away may come back and take it
    walk_speed: float = 0.1  # m/s ahead or back that a RApp may ask for
    side_speed: float = 0.06  # m/s to a side
    turn_speed: float = 0.5  # rad/s
    walk_distance: float = 10.0  # m of one walk or path
    walk_error: float = 0.15  # m beside its goal at which a walk has failed
    turn_error: float = 0.3  # rad
    near: float = 0.3  # m; an obstacle nearer than this stops a robot that walks towards it
    motion_time: float = 180.0  # s of one motion
    posture_speed: float = 0.6  # share of the greatest speed, of postures unless told otherwise
    body_rate: float = 25.0  # 1/s, of joint_states, odom, sonar, bumper and /tf while somebody subscribes
    camera_rate: float = 5.0  # 1/s, of the cameras' topics while somebody subscribes
    camera_resolution: int = 1  # of the cameras' topics: 1 QVGA, 2 VGA, 3 4VGA
    joint_speed: float = 0.3  # share of the greatest speed, of joints unless told otherwise
    warm_up: float = 20.0  # s for a spare to import rospy and join ROS
    first_word: float = 15.0  # s from activation to the dynamic agent's first word
    heartbeat: float = 1.0  # s without a heartbeat after which the lease is silent
    hang: float = 10.0  # s the dynamic agent's own loop may stand still outside of core services
    dismantle: float = 5.0  # s for the dynamic agent to stop what it has started
    terminate: float = 2.0  # s from SIGTERM to SIGKILL
    failures: int = 3  # in a row, of one version of a RApp, after which it is not started for a while
    quarantine: float = 60.0  # s of that while; each further failure doubles it
    quarantine_longest: float = 86_400.0  # s
    limits: Limits = Limits()


def read(words: Sequence[str], env: Mapping[str, str] = os.environ) -> Config:
    """Build the configuration; raises Invalid for a file that cannot be used."""
    parser = argparse.ArgumentParser(prog="core_agent", description="the robot's core agent")
    parser.add_argument("--config", type=Path, help="TOML file of settings (see config/core_agent.toml)")
    parser.add_argument("--robot", help="URL of NAOqi [RAPP_ROBOT]")
    parser.add_argument("--home", type=Path, help="the robot's data folder [RAPP_HOME]")
    parser.add_argument("--name", help="the robot's name at the platform [RAPP_ROBOT_NAME]")
    options = parser.parse_args(words)
    config = _with_file(Config(), options.config) if options.config else Config()
    chosen: dict[str, Any] = {
        "robot": options.robot or env.get("RAPP_ROBOT"),
        "home": options.home or (Path(env["RAPP_HOME"]) if env.get("RAPP_HOME") else None),
        "name": options.name or env.get("RAPP_ROBOT_NAME"),
    }
    config = replace(config, **{name: value for name, value in chosen.items() if value is not None})
    return replace(config, home=config.home.expanduser().resolve())


def _with_file(config: Config, path: Path) -> Config:
    try:
        values = tomllib.loads(path.read_text())
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise Invalid(f"cannot read the settings in {path}: {error}") from error
    limits = replace(config.limits, **_checked(Limits, values.pop("limits", {}), path))
    return replace(config, limits=limits, **_checked(Config, values, path))


def _checked(cls: type[Any], values: Mapping[str, Any], path: Path) -> dict[str, Any]:
    known = {item.name: "" if item.default is MISSING else item.default for item in fields(cls)}
    for name, value in values.items():
        if name not in known:
            raise Invalid(f"cannot use the settings in {path}: there is no {name}; known are {', '.join(known)}")
        wanted = type(known[name])
        if isinstance(value, bool) or not isinstance(value, (int, float) if wanted is float else wanted):
            raise Invalid(f"cannot use the settings in {path}: {name} must be a {wanted.__name__}")
        if isinstance(value, int | float) and not 0 < value < math.inf:
            raise Invalid(f"cannot use the settings in {path}: {name} must be above 0")
    return {name: Path(value) if name == "home" else value for name, value in values.items()}
