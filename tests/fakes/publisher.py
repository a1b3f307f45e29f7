"""A publisher at home: their own key, and what they see of a store as a robot does."""

from pathlib import Path

from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import Targets

from fakes.store_folder import StoreFolder
from rapp_cloud.shelf import Shelf
from rapp_hop.hz.application import Application, first_list, read_application, write_application
from rapp_hop.hz.archive import inspect
from rapp_hop.hz.standing import Standing, signed
from rapp_hop.hz.trust import TrustedStore


class Publisher:
    """`key` may be put in another's place."""

    def __init__(self, name: str, shelf: Shelf, folder: Path) -> None:
        self.name = name
        self.key = CryptoSigner.generate_ed25519()
        self._shelf = shelf
        self._packages = folder / f"{name}-packages"
        self._packages.mkdir(exist_ok=True)
        store = shelf.metadata.parent
        self._store = TrustedStore(StoreFolder(store), "store:", shelf.root_file.read_bytes(), folder / f"{name}-seen")

    def application(self, own: Targets | None = None) -> Application:
        """What asks for the key to be known."""
        return read_application(write_application(self.name, self.key, own or first_list()))

    def join(self, *names: str) -> None:
        """Become a publisher of the store, with these names."""
        self._shelf.custody.add(self.name, self.application())
        self._shelf.custody.grant(self.name, names)

    @property
    def standing(self) -> Standing:
        """How they stand, verified."""
        (found,) = self._store.standings(self.name)
        return found

    def list_with(self, package: bytes, robots: tuple[str, ...] = ()) -> bytes:
        """The next list with a package, signed."""
        with self.file(package).open("rb") as file:
            follows = self.standing.with_package(inspect(file).manifest, package, robots)
        assert follows is not None
        return self.signed(follows)

    def signed(self, own: Targets) -> bytes:
        """A list with their signature."""
        return signed(own, self.key)

    def file(self, package: bytes) -> Path:
        """A package as a file."""
        path = self._packages / "package"
        path.write_bytes(package)
        return path
