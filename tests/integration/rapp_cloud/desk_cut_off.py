"""Cuts one change of a store off at every step of the platform's disk, and tells what a robot believes then.

Words: a folder to begin with, a working folder, the operation, "killed" or "full". Prints one JSON object per step: what was on
offer after the cut and the platform's next start, and after the operation was done again.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cryptography.hazmat.primitives.serialization import load_pem_private_key
from securesystemslib.signer import CryptoSigner

from fakes.cutting import cutter, every_step, one_try, put_in
from fakes.publisher import Publisher
from fakes.store_folder import StoreFolder
from rapp_cloud.shelf import Shelf
from rapp_hop.errors import Refused
from rapp_hop.hz.trust import TrustedStore

OLD, NEW = "clock-1.0.0.hz", "clock-1.1.0.hz"
Operation = Callable[[Shelf, Publisher, Path], None]


def nothing(_deed: str, _subject: str) -> None:
    """There is no audit log here."""


def publish(shelf: Shelf, maria: Publisher, folder: Path) -> None:
    shelf.desk.publish("maria", folder / NEW, (folder / "publish.list").read_bytes(), nothing, 2**30)


def yank(shelf: Shelf, maria: Publisher, folder: Path) -> None:
    shelf.desk.replace("maria", (folder / "yank.list").read_bytes(), nothing, 2**30)


def rotate(shelf: Shelf, maria: Publisher, folder: Path) -> None:
    maria.key = key(folder / "next.pem")
    shelf.custody.rotate("maria", maria.application(maria.standing.renewed()))


OPERATIONS: dict[str, Operation] = {"publish": publish, "yank": yank, "rotate": rotate}


def key(path: Path) -> CryptoSigner:
    return CryptoSigner(load_pem_private_key(path.read_bytes(), None))


def maria_of(shelf: Shelf, folder: Path) -> Publisher:
    maria = Publisher("maria", shelf, folder)
    maria.key = key(folder / "maria.pem")
    return maria


def look(shelf: Shelf, folder: Path) -> dict[str, Any]:
    """What a robot believes that saw the store before; everything on offer is downloaded."""
    robot = TrustedStore(StoreFolder(folder / "tuf"), "store:", shelf.root_file.read_bytes(), folder / "robot")
    found = robot.versions("clock")
    for release in found.releases:
        robot.download(release, folder / "got.hz")
        (folder / "got.hz").unlink()
    key_here = maria_of(shelf, folder).standing.role.keyids[0] == key(folder / "maria.pem").public_key.keyid
    return {
        "offered": [release.version.text for release in found.releases],
        "yanked": sorted(found.yanked),
        "old key": key_here,
        "platform": sorted(offer.manifest.version.text for offer in shelf.offers()),
    }


def done_again(shelf: Shelf, folder: Path, operation: str) -> str:
    """Do it as a person would who saw it fail; gives the error in words."""
    maria = maria_of(shelf, folder)
    try:
        OPERATIONS[operation](shelf, maria, folder)
    except Refused as error:
        return str(error)
    return ""


def cut_off(folder: Path, operation: str, how: str, step: int) -> dict[str, Any]:
    """One try: cut off, start again, do it again."""

    def tried() -> dict[str, Any]:
        seen: list[str] = []
        shelf = Shelf(folder / "tuf", folder / "keys")
        maria = maria_of(shelf, folder)
        if operation == "rotate":
            maria.standing.renewed()  # what it downloads is no step of the platform
        put_in(cutter(how, step, seen))
        try:
            OPERATIONS[operation](shelf, maria, folder)
        except OSError as error:
            return {"error": str(error), "steps": len(seen)}
        return {"error": "", "steps": len(seen)}

    def recovered() -> dict[str, Any]:
        shelf = Shelf(folder / "tuf", folder / "keys")
        shelf.refresh()
        after = look(shelf, folder)
        return {"after": after, "again": done_again(shelf, folder, operation), "end": look(shelf, folder)}

    return one_try(step, tried, recovered)


def main(begin: Path, work: Path, operation: str, how: str) -> None:
    """Go on until the operation comes to its end."""
    every_step(begin, work, lambda step: cut_off(work, operation, how, step))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], sys.argv[4])
