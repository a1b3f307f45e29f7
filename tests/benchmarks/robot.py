"""How good the robot is: what is reached of the aims that a RApp's author may rely on, on the simulated NAO.

    ./rapp bench robot [--rounds N] [--only PART ...]

Starts a ROS master, the simulated NAO in a hall (robot_room.toml) and its core agent; a RApp lends this program its lease, so that
every figure is of `rapp_api`'s own functions, judged by where the simulator says that things truly are. Where the same can be had
without the core agent, it is measured in turn in the same run. Word spotting has a benchmark of its own (`./rapp bench speech`).
Exit status 1 when an aim is missed.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import robot_costs
import robot_moves
import robot_sight
from stage import Result, Stage, staged

CALLS = 200  # of each service
HEAD = ("", "reached", "aim", "in the same run")

Part = Callable[[Stage, int], list[Result]]
PARTS: dict[str, Part] = {  # transforms first: a robot that has walked knows only by odometry where it is
    "transforms": lambda stage, _rounds: robot_moves.transforms(stage),
    "codes": lambda stage, _rounds: robot_sight.codes(stage),
    "looks": lambda stage, _rounds: robot_sight.looks(stage),
    "pictures": lambda stage, _rounds: robot_sight.pictures(stage),
    "services": lambda stage, _rounds: robot_costs.services(stage, CALLS),
    "walks": robot_moves.walks,
    "stops": robot_moves.stops,
}
SPEED = "speed"  # is measured without the robot, which would share the processors


def table(results: list[Result]) -> str:
    """As the README has it."""
    lines = [f"| {' | '.join(HEAD)} |", "|---|---|---|---|"]
    for result in results:
        missed = "" if result.kept else " **missed**"
        lines.append(f"| {result.what} | {result.reached}{missed} | {result.aim} | {result.bare} |")
    return "\n".join(lines)


def measure(rounds: int, parts: list[str]) -> list[Result]:
    """All lines of the table."""
    results = robot_costs.speed() if SPEED in parts else []
    wanted = [part for name, part in PARTS.items() if name in parts]
    if wanted:
        with tempfile.TemporaryDirectory(prefix="rapp-robot-") as folder, staged(Path(folder)) as stage:
            for part in wanted:
                results += part(stage, rounds)
    return results


def main() -> int:
    known = [*PARTS, SPEED]
    parser = argparse.ArgumentParser(prog="bench robot", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=4, help="walks of each kind, and stops (%(default)s; one takes 20 s)")
    parser.add_argument("--only", nargs="+", choices=known, default=known, metavar="PART", help=", ".join(known))
    options = parser.parse_args()
    results = measure(options.rounds, options.only)
    print(table(results))
    return 0 if all(result.kept for result in results) else 1


if __name__ == "__main__":
    sys.exit(main())
