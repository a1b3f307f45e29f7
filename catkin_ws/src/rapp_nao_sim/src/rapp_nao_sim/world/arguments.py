"""Reads the arguments of NAOqi's motion calls, which name joints and give values in several shapes."""

import math
from collections.abc import Sequence
from typing import Any

from rapp_nao_sim.naoqi import NaoqiError
from rapp_nao_sim.world.model import CHAINS, JOINTS

MOST_POINTS = 1000  # of one interpolation


def joints(names: str | Sequence[str]) -> list[str]:
    """The joints meant by names of joints and groups; raises NaoqiError for an unknown one."""
    result: list[str] = []
    for name in [names] if isinstance(names, str) else names:
        if name not in JOINTS and name not in CHAINS:
            raise NaoqiError(f"cannot find joint {name!r}: known are {', '.join([*CHAINS, *JOINTS])}")
        result += CHAINS.get(name, [name])
    return result


def spread(values: Any, count: int) -> list[float]:
    """A number for each of `count` joints: one for all, or a list of as many."""
    numbers = [number(value) for value in values] if isinstance(values, list | tuple) else [number(values)] * count
    if len(numbers) != count:
        raise NaoqiError(f"cannot use {len(numbers)} values for {count} joints: give one, or one for each")
    return numbers


def ways(values: Any, count: int) -> list[list[float]]:
    """A list of numbers for each of `count` joints, from a list of lists, a list for one joint, or numbers as in spread."""
    if isinstance(values, list | tuple) and values and all(isinstance(value, list | tuple) for value in values):
        result = [[number(part) for part in value] for value in values]
    elif count == 1 and isinstance(values, list | tuple):
        result = [[number(value) for value in values]]
    else:
        result = [[value] for value in spread(values, count)]
    if len(result) != count or not all(result) or sum(map(len, result)) > MOST_POINTS:
        raise NaoqiError(f"cannot use these values for {count} joints: give a list for each, {MOST_POINTS} values at most")
    return result


def number(value: Any) -> float:
    """A finite number; raises NaoqiError for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise NaoqiError(f"cannot use {value!r} as a number")
    return float(value)
