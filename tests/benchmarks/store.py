"""What the RApp store costs: downloads beside nginx, installation by phase, many robots, many RApps.

    ./rapp bench store [downloads] [install] [robots] [catalogue] [options]

Starts a platform and nginx on free ports of this machine, with folders of their own, and ends them. Downloads take turns
with the same load, so that a busy machine slows both; judge the share, not the downloads per second. The load needs a core too.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks import store_catalogue, store_downloads, store_install, store_robots

PARTS: dict[str, Callable[[Path, argparse.Namespace], None]] = {
    "downloads": store_downloads.measure,
    "install": store_install.measure,
    "robots": store_robots.measure,
    "catalogue": store_catalogue.measure,
}
"""In the order in which they are measured."""


def main() -> int:
    """Measure what the words name, everything when they name nothing."""
    parser = argparse.ArgumentParser(prog="bench store", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)} (all)")
    parser.add_argument("--rounds", type=int, default=7, help="of downloads from both servers (%(default)s)")
    parser.add_argument("--seconds", type=float, default=1.0, help="of each (%(default)s)")
    parser.add_argument("--connections", type=int, default=4, help="of the downloads, kept open (%(default)s)")
    parser.add_argument("--installs", type=int, default=15, help="of each kind (%(default)s)")
    parser.add_argument("--robots", type=int, default=1000, help="that are registered (%(default)s)")
    parser.add_argument("--watch", type=float, default=20.0, help="seconds to watch them (%(default)s)")
    parser.add_argument("--rapps", type=int, nargs="+", default=[100, 10_000], help="in the catalogue, a column each (%(default)s)")
    parser.add_argument("--calls", type=int, default=10, help="of each kind to the catalogue (%(default)s)")
    options = parser.parse_args()
    if strange := set(options.parts) - set(PARTS):
        parser.error(f"cannot measure {min(strange)}: there are {', '.join(PARTS)}")
    for name, measure in PARTS.items():
        if not options.parts or name in options.parts:
            with tempfile.TemporaryDirectory(prefix="rapp-bench-") as folder:
                measure(Path(folder), options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
