"""Where everything lies in the drawing of a run (pure). Lengths are px, y grows downwards as time does."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from rapp_cli.trace.messages import Item, pairs
from rapp_cli.trace.participants import NAMES, participants

LINE = 15  # from one line of text to the next
HEAD = 30  # height of a participant's box
TOP = 84  # of the first row; above it are the title and the participants
TIMES = 60  # width of the column of times
GAP = 14  # between things side by side
WRAP, WRAP_NOTE = 42, 28  # characters in a line
BAR = 5  # half the width of an activation
_NARROW, _WIDE = frozenset("fijlrt.,:;'|!()[]“” "), frozenset("mwMW@%—…")


@dataclass(frozen=True)
class Row:
    """One item: its lines of text and where; `y` is that of the arrow, or of the lower edge of a note."""

    item: Item
    lines: tuple[str, ...]
    y: float
    left: float  # of the arrow, or of the note
    right: float


@dataclass(frozen=True)
class Bar:
    """An activation: somebody works on a call."""

    name: str
    top: float
    bottom: float
    depth: int  # of others within which it lies


@dataclass(frozen=True)
class Layout:
    """The whole drawing."""

    columns: dict[str, float]  # x of each lifeline
    rows: tuple[Row, ...]
    bars: tuple[Bar, ...]
    width: float
    bottom: float  # where the lifelines end


def text_width(text: str) -> float:
    """Width at 12 px, rather too much than too little: the reader's font is not known."""
    return sum(4.6 if c in _NARROW else 10.5 if c in _WIDE else 8.6 if c.isupper() else 7.3 for c in text)


def head_width(name: str) -> float:
    """Width of a participant's box."""
    return text_width(NAMES.get(name, name)) * 1.08 + 2 * GAP


def lay_out(items: Sequence[Item]) -> Layout:
    """Place everything: columns as far apart as their labels need, rows one below the other."""
    wrapped = [tuple(textwrap.wrap(i.label, WRAP_NOTE if i.source == i.target else WRAP)) or ("",) for i in items]
    names = participants(items)
    columns = _columns(names, items, wrapped)
    depths, y = [], float(TOP)
    for lines in wrapped:
        y += LINE * len(lines) + GAP
        depths.append(y)
    bars = _bars(items, depths)
    rows = [_row(item, lines, at, columns, bars) for item, lines, at in zip(items, wrapped, depths, strict=True)]
    right = max((row.right for row in rows), default=0.0)
    width = max([right, *(x + head_width(name) / 2 for name, x in columns.items())]) + GAP
    return Layout(columns, tuple(rows), tuple(bars), width, y + 1.5 * GAP)


def _columns(names: Sequence[str], items: Sequence[Item], wrapped: Sequence[Sequence[str]]) -> dict[str, float]:
    place = {name: index for index, name in enumerate(names)}
    needs = {(i, i + 1): (head_width(a) + head_width(b)) / 2 + GAP for i, (a, b) in enumerate(pairwise(names))}
    first = head_width(names[0]) / 2 if names else 0.0

    def need(i: int, j: int, width: float) -> None:
        needs[i, j] = max(needs.get((i, j), 0.0), width)

    for item, lines in zip(items, wrapped, strict=True):
        width, (i, j) = max(map(text_width, lines)), sorted((place[item.source], place[item.target]))
        if i != j:
            need(i, j, width + 4 * GAP)
            continue
        half = width / 2 + 2 * GAP
        need(i, i + 1, half)
        if i:
            need(i - 1, i, half)
        else:
            first = max(first, half)
    xs: list[float] = []
    for j in range(len(names)):
        xs.append(max([TIMES + first, *(xs[i] + needs[i, j] for i in range(j) if (i, j) in needs)]))
    return dict(zip(names, xs, strict=True))


def _bars(items: Sequence[Item], ys: Sequence[float]) -> list[Bar]:
    bars: list[Bar] = []
    for call, reply in pairs(items):
        name, top = items[call].target, ys[call]
        depth = sum(bar.name == name and bar.bottom > top for bar in bars)
        bars.append(Bar(name, top, ys[reply], depth))
    return bars


def _row(item: Item, lines: tuple[str, ...], y: float, columns: dict[str, float], bars: Sequence[Bar]) -> Row:
    if item.source == item.target:
        half = max(map(text_width, lines)) / 2 + GAP / 2
        return Row(item, lines, y, columns[item.source] - half, columns[item.source] + half)
    left, right = sorted((item.source, item.target), key=columns.__getitem__)
    return Row(item, lines, y, columns[left] + _edge(left, y, bars, 4), columns[right] - _edge(right, y, bars, 0))


def _edge(name: str, y: float, bars: Sequence[Bar], step: int) -> float:
    """How far an arrow ends from a lifeline, on whose activations it ends; inner ones lie `step` further to the right."""
    return max((BAR + step * bar.depth for bar in bars if bar.name == name and bar.top <= y <= bar.bottom), default=0)
