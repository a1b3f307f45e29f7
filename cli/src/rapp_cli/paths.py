"""Where things lie in a checkout of this repository."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
"""The checkout's top folder."""

STORE = ROOT / "store"
"""Sources of the RApps that come with the repository."""

ROBOT_SCRIPTS = ROOT / "catkin_ws" / "src" / "rapp_core" / "scripts"
"""Starters of the robot's processes."""

BENCHMARKS = ROOT / "tests" / "benchmarks"
"""Programs that measure, one per subject."""
