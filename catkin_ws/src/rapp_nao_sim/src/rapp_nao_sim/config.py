"""Settings of the simulator: one frozen object, from options and environment."""

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Config:
    """Every setting; sound levels are root mean squares of 16-bit samples."""

    address: str = "127.0.0.1"
    port: int = 9559  # of NAOqi; 0: any free one
    microphone: str = "sound"  # sound: heard by pocketsphinx; text: fed with what people say as text
    voice: str = "espeak"  # espeak: spoken in real time; silent: nothing sounds and saying takes no time
    robot_voice: str = "en-us"  # espeak-ng voice of the robot's English
    files: tuple[Path, ...] = field(default_factory=lambda: (Path("/home/nao"), Path("/tmp")))  # where clients may write
    ambient: float = 60.0  # noise floor of the room; pure silence would spoil the recogniser's probabilities
    person_level: float = 0.5  # share of full scale of a person's voice at the microphone
    echo: float = 0.03  # share of the robot's own voice that its microphone picks up
    world: bool = True  # whether there is a body in a room
    room: Path | None = None  # room file; None: our own
    gui: bool = False  # whether a window shows the room


def read(words: Sequence[str], env: Mapping[str, str] = os.environ) -> Config:
    """Read options, over environment (RAPP_NAO_PORT), over defaults."""
    default = Config()
    parser = argparse.ArgumentParser(prog="nao_sim", description="a simulated NAO behind NAOqi's qi protocol")
    parser.add_argument("--address", default=default.address, help="where to listen (%(default)s)")
    parser.add_argument("--port", type=_port, default=env.get("RAPP_NAO_PORT", str(default.port)), help="0: any free one")
    parser.add_argument("--microphone", choices=("sound", "text"), default=default.microphone)
    parser.add_argument("--voice", choices=("espeak", "silent"), default=default.voice)
    parser.add_argument("--files", type=Path, action="append", help="a folder where clients may write (repeatable)")
    parser.add_argument("--ambient", type=_level, default=default.ambient, help="noise floor, RMS of 16-bit samples")
    parser.add_argument("--room", type=Path, metavar="FILE", help="room file (default: our own)")
    parser.add_argument("--gui", action="store_true", help="show the room in a window")
    parser.add_argument("--no-world", action="store_true", help="voice and ears only, no body in a room")
    options = parser.parse_args(words)
    return Config(
        address=options.address,
        port=options.port,
        microphone=options.microphone,
        voice=options.voice,
        files=tuple(options.files) if options.files else default.files,
        ambient=options.ambient,
        world=not options.no_world,
        room=options.room,
        gui=options.gui,
    )


def _port(word: str) -> int:
    """A TCP port; argparse makes a clear error of a ValueError."""
    port = int(word)
    if not 0 <= port < 65536:
        raise argparse.ArgumentTypeError(f"{port} is no port: give 0 to 65535")
    return port


def _level(word: str) -> float:
    level = float(word)
    if not 0 <= level <= 16_000:
        raise argparse.ArgumentTypeError(f"{word} is no noise floor: give 0 to 16000")
    return level
