"""A power cut (kill -9) or full disk at any step on the robot leaves a version that works; the next start leaves nothing half done.

One table over every step of every operation; `cut_off.py` does the cutting.
"""

import asyncio
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import source_folder
from fakes.store_client import StoreClient
from rapp_cloud.shelf import Shelf
from rapp_hop.hz.archive import build
from rapp_hop.hz.delivery import Delivery

SCRIPT = Path(__file__).with_name("cut_off.py")
TESTS = SCRIPT.parents[2]
FILES = {version: f"print({version!r})\n" for version in ("1.0.0", "1.1.0")}  # the programs


def publish(store: Path, version: str) -> None:
    source = source_folder(store.parent / version, version=version, program=FILES[version])
    (source / "sound.txt").write_text(f"{os.urandom(40_000).hex()}{version}")
    Shelf(store, store.parent / "keys").publish(build(source))


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("store")
    Shelf(folder / "tuf", folder / "keys").create()
    return folder / "tuf"


@pytest.fixture(scope="module")
def homes(store: Path) -> dict[str, Path]:
    """Robots to begin with: nothing installed; 1.0.0; 1.0.0 and 1.1.0, which has not started yet."""
    homes = {name: store.parent / name for name in ("nothing", "old", "trial")}
    homes["nothing"].mkdir()
    for name, versions in (("old", ("1.0.0",)), ("trial", ("1.0.0", "1.1.0"))):
        for version in versions:
            if not (store.parent / version).exists():
                publish(store, version)
            delivery = Delivery(StoreClient(store), (store / "metadata/1.root.json").read_bytes(), homes[name])  # type: ignore[arg-type]
            asyncio.run(delivery.install("hello", version))
    return homes


OLD, NEW = "1.0.0", "1.1.0"
TABLE = [  # operation, home, what may be current after a cut, what is in the RApp's folder when it was done again
    ("install", "nothing", {None, NEW}, [NEW, "current"]),
    ("install", "old", {OLD, NEW}, [OLD, NEW, "current", "previous"]),
    ("started", "trial", {NEW}, [NEW, "current"]),
    ("did not start", "trial", {OLD, NEW}, [OLD, "current", "failed"]),
    ("remove", "old", {OLD, None}, []),
]


@pytest.mark.parametrize("how", ["killed", "full"])
@pytest.mark.parametrize(("operation", "home", "allowed", "end"), TABLE, ids=[f"{row[0]}, {row[1]}" for row in TABLE])
def test_every_step(
    store: Path,
    homes: dict[str, Path],
    tmp_path: Path,
    operation: str,
    home: str,
    allowed: set[str | None],
    end: list[str],
    how: str,
) -> None:
    tries = run(store, homes[home], tmp_path / "robot", operation, how)
    for told in tries:
        assert "fault" not in told, told["fault"]
        whole(told["after"], allowed, told)
        whole(told["end"], {name for name in end if name in FILES and "current" in end} or {None}, told)
        assert told["again"] == "", told
        assert (told["end"]["names"], told["end"]["downloads"]) == (end, []), told
    assert {told["after"]["current"] for told in tries} == allowed
    if how == "killed":
        assert [told["killed"] for told in tries] == [True] * (len(tries) - 1) + [False]
    else:
        errors = {told["error"].partition(":")[0] for told in tries[:-1]} - {""}
        assert errors == {"refused"}, errors
        assert all(told["error"] == "" or "No space left" in told["error"] for told in tries), tries


def run(store: Path, home: Path, work: Path, operation: str, how: str) -> list[dict[str, Any]]:
    words = [sys.executable, str(SCRIPT), str(store), str(home), str(work), operation, how]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(words, env=env, capture_output=True, text=True, timeout=110, check=False)
    assert done.returncode == 0, done.stderr
    tries = [json.loads(line) for line in done.stdout.splitlines()]
    print(f"{operation}, {home.name}, {how}: {len(tries)} steps")
    return tries


def whole(there: dict[str, Any], allowed: set[str | None], told: dict[str, Any]) -> None:
    """One of the versions allowed, all of it, and nothing half done beside it."""
    version = there["current"]
    assert version in allowed, told
    assert set(there["rapps"]) <= {".lock", "hello"}, told
    assert not [name for name in there["names"] if name.startswith(".")], told
    assert set(there["downloads"]) <= {".part"}, told
    if version is not None:
        assert there["files"]["agent.py"] == FILES[version], told
        assert there["files"]["sound.txt"].endswith(version) and len(there["files"]["sound.txt"]) == 80_005, told
        assert json.loads(there["files"]["package.json"])["version"] == version, told
