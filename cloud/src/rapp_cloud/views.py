"""The catalogue as robots of each kind see it, made once for each state of the store."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from rapp_cloud.catalogue import RobotKind, catalogue, commands
from rapp_hop.hz.manifest import Manifest

Manifests = tuple[Manifest, ...]
_KINDS = 8  # of robots (and languages) whose views are kept


class Views:
    """Views of one store. What they give is shared, not to be changed. May be asked by several threads at once."""

    def __init__(self, manifests: Callable[[], Manifests]) -> None:
        """Take where the manifests of all packages on offer come from; the same tuple again says that nothing has changed."""
        self._manifests = manifests
        self._view = _View(())

    def described(self, kind: RobotKind) -> list[dict[str, Any]]:
        """Return the catalogue as `list_rapps` gives it. Blocking."""
        return self._now().described(kind)

    def commands(self, kind: RobotKind, language: str) -> dict[str, tuple[str, ...]]:
        """Return what one can say; see `catalogue.commands`. Blocking."""
        return self._now().commands(kind, language)

    def _now(self) -> "_View":
        manifests, view = self._manifests(), self._view
        if view.manifests is not manifests:
            view = self._view = _View(manifests)
        return view


class _View:
    """One state of the store."""

    def __init__(self, manifests: Manifests) -> None:
        self.manifests = manifests
        self.entries = lru_cache(_KINDS)(lambda kind: catalogue(manifests, kind))
        self.described = lru_cache(_KINDS)(lambda kind: [entry.describe() for entry in self.entries(kind)])
        self.commands = lru_cache(_KINDS)(lambda kind, language: commands(self.entries(kind), language))
