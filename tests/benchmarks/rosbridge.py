"""What the bridge costs, beside what the machine allows: calls, topics in every encoding, fan-out, slow readers, offered services.

    ./rapp bench rosbridge [--only SECTION ...]

Starts a ROS master, two nodes, a bare Tornado WebSocket server and the bridge on free ports of this machine, measures for about
a minute and ends them all. Bare limits are measured in turn with the bridge. An aim that has a bare limit is a multiple of it, so
that it holds on any machine; rates and the slowest of a hundred move with what else the machine does, processor time per message
moves less. Exit status 1 when an aim is missed.
"""

import argparse
import asyncio
import sys
import tempfile
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial

import rosbridge_work as work
import uvloop
from rosbridge_stage import Stage, staged
from rosbridge_work import Figures, Measured


@dataclass(frozen=True)
class Aim:
    """A bound of one figure; `bare`: what the limit's figure was on the machine that the bound is of, where they are related."""

    figure: str
    bound: float
    bare: float | None = None

    def here(self, bare: Figures) -> float:
        """The bound on this machine."""
        return self.bound * bare[self.figure] / self.bare if self.bare else self.bound

    def is_kept(self, ours: Figures, bare: Figures) -> bool:
        reached, bound = ours[self.figure], self.here(bare)
        return reached >= bound if self.figure in AT_LEAST else reached <= bound


AT_LEAST = ("per_s", "hz")
UNITS = {
    "per_s": "{:.0f}/s", "cpu_us": "{:.1f} µs CPU", "p50_ms": "p50 {:.2f} ms", "p99_ms": "p99 {:.1f} ms", "lost": "{:.0f} lost",
    "hz": "{:.1f} Hz", "grown_mb": "{:+.1f} MB", "grown_fds": "{:+.0f} descriptors", "waiting_percent": "{:.1f} % while waiting",
    "seconds": "{:.2f} s", "share": "{:.0%} came",
}  # fmt: skip


@dataclass(frozen=True)
class Section:
    """A line of the table."""

    what: str
    measure: Callable[[Stage], Awaitable[Measured]]
    aims: tuple[Aim, ...] = ()


def _stream(kind: str, compression: str, *aims: Aim, readers: int = 1) -> Section:
    name = "json" if compression == "none" else compression
    measure = partial(work.stream, kind=kind, compression=compression, readers=readers)
    return Section(f"{kind} {name}, {readers} client{'s' * (readers > 1)}", measure, aims)


SMALL = (Aim("per_s", 35_000, 79_000), Aim("cpu_us", 20, 12.5))
SECTIONS = {
    "a1": Section("calls, 1 client", partial(work.calls, clients=1), (Aim("per_s", 4000, 15_600), Aim("p50_ms", 0.3))),
    "a2": Section("calls, 32 clients", partial(work.calls, clients=32), (Aim("per_s", 5000, 38_900), Aim("p99_ms", 25))),
    "b1": Section("publish flood", work.publish_flood, (Aim("per_s", 40_000, 231_000), Aim("lost", 0))),
    "c0": Section("tick, 200 Hz", work.tick, (Aim("p99_ms", 3),)),
    "c1": _stream("small", "none", *SMALL),
    "c2": _stream("small", "cbor", *SMALL),
    "c3": _stream("small", "cbor-raw", *SMALL),
    "c4": _stream("scan", "none", Aim("cpu_us", 60, 16)),
    "c5": _stream("scan", "cbor", Aim("cpu_us", 40, 16)),
    "c6": _stream("vga", "none", Aim("cpu_us", 1500, 1170)),
    "c7": _stream("vga", "png", Aim("cpu_us", 6000, 1170)),
    "c8": _stream("vga", "cbor", Aim("cpu_us", 700, 1170)),
    "c9": _stream("hd", "none", Aim("cpu_us", 6500, 4600)),
    "c10": _stream("hd", "png", Aim("cpu_us", 25_000, 4600)),
    "c11": _stream("hd", "cbor", Aim("cpu_us", 3000, 4600)),
    "d1": _stream("small", "none", Aim("per_s", 50_000, 90_000), Aim("cpu_us", 16, 10.7), readers=50),
    "d2": _stream("vga", "none", Aim("cpu_us", 700), readers=10),
    "d3": _stream("vga", "cbor", Aim("cpu_us", 400), readers=10),
    "f": Section("reader beside a sleeping one", work.slow_reader, (Aim("hz", 98), Aim("grown_mb", 32))),
    "h": Section("service of a client", work.offered, (Aim("per_s", 4000, 15_500), Aim("waiting_percent", 1))),
    "h2": Section("the same, looked up each time", work.looked_up),
    "i": Section("its provider leaves", work.provider_leaves, (Aim("seconds", 1),)),
    "e": Section("visits of clients", work.visits, (Aim("per_s", 1000), Aim("grown_mb", 2), Aim("grown_fds", 5))),
}


def row(name: str, section: Section, ours: Figures, bare: Figures) -> tuple[str, bool]:
    """A line as the README has it, and whether all its aims are kept."""
    aims = [f"{'≥' if aim.figure in AT_LEAST else '≤'} {_shown(aim.figure, aim.here(bare))}" for aim in section.aims]
    kept = all(aim.is_kept(ours, bare) for aim in section.aims)
    cells = [name, section.what, _all_shown(ours) + ("" if kept else " **missed**"), ", ".join(aims), _all_shown(bare)]
    return f"| {' | '.join(cells)} |", kept


def _all_shown(figures: Figures) -> str:
    return ", ".join(_shown(figure, value) for figure, value in figures.items())


def _shown(figure: str, value: float) -> str:
    return UNITS[figure].format(value)


async def measure(stage: Stage, names: list[str]) -> bool:
    """Print the table; whether all aims are kept."""
    print("| | | the bridge | aim here | bare limit, in the same run |\n|---|---|---|---|---|", flush=True)
    all_kept = True
    for name in names:
        ours, bare = await SECTIONS[name].measure(stage)
        line, kept = row(name, SECTIONS[name], ours, bare)
        print(line, flush=True)
        all_kept = all_kept and kept
    return all_kept


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="bench rosbridge", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    known = list(SECTIONS)
    parser.add_argument("--only", nargs="+", choices=known, default=known, metavar="SECTION", help=", ".join(known))
    options = parser.parse_args()
    with (
        tempfile.TemporaryDirectory(prefix="rapp-rosbridge-") as folder,
        staged(folder) as stage,
        asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner,
    ):
        return 0 if runner.run(measure(stage, options.only)) else 1


if __name__ == "__main__":
    sys.exit(main())
