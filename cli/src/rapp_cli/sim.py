"""`./rapp sim`: the simulated NAO alone, in the foreground; or a photograph of its room."""

import argparse
import os
import sys
from pathlib import Path

from rapp_cli.errors import UsageError

_SIMULATOR, _PHOTOGRAPHER = "rapp_nao_sim", "rapp_nao_sim.world"
_RUNNING: tuple[str, ...] = ("room", "port", "microphone", "voice", "gui")  # what the simulator takes
_TAKING: tuple[str, ...] = ("shot", "room", "door", "lamp", "posture")  # what the photographer takes


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp sim`; without a value, the simulator's own choice."""
    parser.add_argument("--room", type=Path, metavar="FILE", help="the room, described in a file (default: our own)")
    parser.add_argument("--port", type=int, help="of NAOqi; 0: any free one (default: 9559)")
    parser.add_argument("--microphone", choices=("sound", "text"), help="hear sound, or be fed with text")
    parser.add_argument("--voice", choices=("espeak", "silent"), help="speak aloud, or at once and silently")
    parser.add_argument("--gui", action="store_true", help="show the room in a window, where there is a screen")
    parser.add_argument("--shot", type=Path, metavar="FILE.png", help="only photograph the room")
    parser.add_argument("--door", type=float, metavar="RAD", help="with --shot: opening angle of the door")
    parser.add_argument("--lamp", type=float, metavar="LEVEL", help="with --shot: from 0 to 1")
    parser.add_argument("--posture", help="with --shot: of the robot")


def run(options: argparse.Namespace) -> int:
    """Become the simulator, or the photographer; ends with its exit status. Ctrl-C ends it."""
    words = command(options)
    sys.stdout.flush()
    os.execv(sys.executable, [sys.executable, "-m", *words])


def command(options: argparse.Namespace) -> list[str]:
    """The module to run and its words; raises UsageError for options that do not go together."""
    module, fitting, others, how = _SIMULATOR, _RUNNING, _TAKING, "without"
    if options.shot is not None:
        module, fitting, others, how = _PHOTOGRAPHER, _TAKING, _RUNNING, "with"
    wrong = next((name for name in others if name not in fitting and _given(options, name)), None)
    if wrong is not None:
        raise UsageError(f"cannot use --{wrong} {how} --shot")
    words = [module]
    for name in fitting:
        if _given(options, name):
            words.append(f"--{name}" if name == "gui" else f"--{name}={getattr(options, name)}")
    return words


def _given(options: argparse.Namespace, name: str) -> bool:
    value = getattr(options, name)
    return value is not None and value is not False
