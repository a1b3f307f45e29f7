"""The packages of cloud agents: found on the shelf, unpacked once. Blocking."""

import shutil
import threading
from pathlib import Path

from rapp_cloud.catalogue import cloud_agent_of
from rapp_cloud.shelf import Shelf
from rapp_hop.hz.manifest import Manifest


class Packages:
    """What the shelf holds for the cloud; for any thread."""

    def __init__(self, shelf: Shelf, folder: Path) -> None:
        """Prepare.

        :param folder: for unpacked packages, ours alone
        """
        self._shelf = shelf
        self._folder = folder
        self._lock = threading.Lock()

    def open(self) -> None:
        """Begin with none unpacked: what lies there may be half of one."""
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True, mode=0o700)

    def any(self) -> bool:
        """Whether there is any cloud agent on the shelf."""
        return any(manifest.agent == "cloud" for manifest in self._shelf.manifests())

    def find(self, rapp: str, version: str) -> tuple[Manifest, Path]:
        """Return the cloud agent's manifest and unpacked package for a version of a RApp.

        :raises Refused: there is none
        """
        manifest = cloud_agent_of(self._shelf.manifests(), rapp, version)
        place = self._folder / f"{manifest.name}-{manifest.version.text}"
        with self._lock:
            if not place.exists():  # a version never changes once it is published (S20)
                self._shelf.unpack(manifest.name, manifest.version.text, place)
        return manifest, place
