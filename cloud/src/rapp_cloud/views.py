"""What is made of the catalogue once for each state of the store, such as how robots of each kind see it."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Generic, TypeVar

from rapp_cloud.catalogue import RobotKind, catalogue, commands
from rapp_hop.hz.manifest import Manifest

Manifests = tuple[Manifest, ...]
Made = TypeVar("Made")
_KINDS = 8  # of robots (and languages) whose views are kept


class Once(Generic[Made]):
    """Something that is made of a store's packages, once for each state. It is shared. May be asked by several threads."""

    def __init__(self, manifests: Callable[[], Manifests], make: Callable[[Manifests], Made]) -> None:
        """Take what makes it, and where the manifests come from; the same tuple again says that nothing has changed."""
        self._manifests = manifests
        self._make = make
        self._made: tuple[Manifests, Made] | None = None

    def __call__(self) -> Made:
        """Return it. Blocking."""
        manifests, made = self._manifests(), self._made
        if made is None or made[0] is not manifests:
            made = self._made = manifests, self._make(manifests)
        return made[1]


class Views:
    """Views of one store. What they give is shared, not to be changed. May be asked by several threads at once."""

    def __init__(self, manifests: Callable[[], Manifests]) -> None:
        """Take where the manifests of all packages on offer come from; see `Once`."""
        self._now = Once(manifests, _View)

    def described(self, kind: RobotKind) -> list[dict[str, Any]]:
        """Return the catalogue as `list_rapps` gives it. Blocking."""
        return self._now().described(kind)

    def commands(self, kind: RobotKind, language: str) -> dict[str, tuple[str, ...]]:
        """Return what one can say; see `catalogue.commands`. Blocking."""
        return self._now().commands(kind, language)


class _View:
    """One state of the store."""

    def __init__(self, manifests: Manifests) -> None:
        self.entries = lru_cache(_KINDS)(lambda kind: catalogue(manifests, kind))
        self.described = lru_cache(_KINDS)(lambda kind: [entry.describe() for entry in self.entries(kind)])
        self.commands = lru_cache(_KINDS)(lambda kind, language: commands(self.entries(kind), language))
