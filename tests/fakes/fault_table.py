"""A table of cases, states x faults, of a whole robot: each is reached, suffered and timed; printed when all are known.

Each column has a robot of its own, so that columns run side by side.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from fakes.whole_robot import PATIENCE, Seen, WholeRobot, entered, listening_after, whole_robot

Fault = tuple[str, str]  # name of a process, and what happens to it: "killed" or "frozen"; or of a line that is "cut"


@dataclass(frozen=True)
class Cell:
    """How one case went: s from the end of the fault until s3, and until all was well; or what went wrong."""

    listening: float
    well: float
    problem: str = ""


Cells = dict[tuple[str, str, str], Cell]  # by state, process and what happens to it


@dataclass(frozen=True)
class FaultTable:
    """`suffer` makes one case: robot, state, process, what happens to it; the RApp `fine`, which says so, is among `packages`."""

    states: Sequence[str]
    faults: Sequence[Fault]
    suffer: Callable[[WholeRobot, str, str, str], Cell]
    patience: float = PATIENCE  # s for `serve`
    processes: tuple[str, ...] = ()  # of the robot; none: all
    robot: Callable[[Fault], type[WholeRobot]] = lambda _: WholeRobot

    def fill(self, folder: Path, packages: list[Path], at_once: int) -> Cells:
        """All cases, `at_once` columns at a time."""
        cells: Cells = {}
        with ThreadPoolExecutor(at_once) as pool:
            for part in pool.map(lambda fault: self._column(folder / "-".join(fault), packages, fault), self.faults):
                cells |= part
        return cells

    def _column(self, folder: Path, packages: list[Path], fault: Fault) -> Cells:
        """All states with one fault, on one robot; a case that fails gives the next one a new robot.

        A robot that does not serve at first is the failure of all cases that were to come; one that does not end, of the last one.
        """
        cells: Cells = {}
        states = list(self.states)
        while states:
            robot = self.robot(fault)(folder / f"robot-{len(states)}", packages)
            try:
                with whole_robot(robot, *self.processes):
                    serve(robot, self.patience)
                    self._suffered(robot, fault, states, cells)
            except Exception as error:  # noqa: BLE001 - whatever it is, it is this column's, and the table goes on
                cells |= dict.fromkeys([(state, *fault) for state in states or self.states[-1:]], _failed(robot, error))
                break
        return cells

    def _suffered(self, robot: WholeRobot, fault: Fault, states: list[str], cells: Cells) -> None:
        """Take one state after the other off the list, until a case fails."""
        while states:
            state = states.pop(0)
            try:
                cells[(state, *fault)] = self.suffer(robot, state, *fault)
            except Exception as error:  # noqa: BLE001 - whatever it is, it is this cell's, and the table goes on
                cells[(state, *fault)] = _failed(robot, error)
                return

    def show(self, title: str, cells: Cells) -> None:
        """Print it."""
        width = max(map(len, self.states)) + 1
        print(f"\n{title}")
        print(" " * width + "".join(f"{name + ' ' + how:>19}" for name, how in self.faults))
        for state in self.states:
            row = [cells[(state, *fault)] for fault in self.faults]
            texts = ["failed" if cell.problem else f"{cell.listening:.1f} / {cell.well:.1f}" for cell in row]
            print(f"{state:{width}}" + "".join(f"{text:>19}" for text in texts))


def _failed(robot: WholeRobot, error: Exception) -> Cell:
    story = f"{type(error).__name__}: {error}\n{robot.story(max(0, len(robot.seen) - 80))}"
    return Cell(0.0, 0.0, story[-12000:])


def serve(robot: WholeRobot, patience: float = PATIENCE) -> Seen:
    """Ask for a RApp until it was run to its end; gives when it spoke."""
    deadline = time.monotonic() + patience
    while True:
        since = len(robot.seen)
        with suppress(AssertionError):
            robot.ask("fine")
            spoken = robot.until(lambda seen: seen.kind == "said" and seen.detail == "fine", since, 5.0)
            robot.until(listening_after(spoken), since)
            return spoken
        assert time.monotonic() < deadline, f"it is not served again\n{robot.story(since)}"


def listened_before(robot: WholeRobot, served: Seen) -> Seen:
    """When the robot last entered s3 before it served a request."""
    return next(seen for seen in reversed(robot.seen) if seen.time < served.time and entered("s3")(seen))
