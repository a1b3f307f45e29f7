"""A store with one small package, and robots that look at it."""

import shutil
from pathlib import Path

from fakes.packages import source_folder
from fakes.store_folder import StoreFolder
from rapp_cloud.shelf import Shelf
from rapp_hop.hz.archive import build
from rapp_hop.hz.trust import TrustedStore


def shelf_with_hello(folder: Path) -> Shelf:
    shelf = Shelf(folder / "tuf", folder / "keys")
    shelf.create()
    shelf.publish(package(folder))
    return shelf


def robot_of(shelf: Shelf, folder: Path, seen: str) -> TrustedStore:
    """A robot that got the first root; `seen`: its folder of what it has seen."""
    return TrustedStore(StoreFolder(folder / "tuf"), "store:", shelf.root_file.read_bytes(), folder / seen)


def package(folder: Path, name: str = "hello", version: str = "1.0.0", program: str = "pass\n") -> bytes:
    source = folder / "sources" / program.strip()
    shutil.rmtree(source, ignore_errors=True)
    return build(source_folder(source, name, version, program))


def offered(robot: TrustedStore, name: str = "hello") -> list[str]:
    return [release.version.text for release in robot.versions(name).releases]
