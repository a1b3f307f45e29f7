"""All services of one server: by name, by path, and for how long."""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

from rapp_hop.errors import Refused
from rapp_hop.openapi import document
from rapp_hop.service import BASE, Service, check_path, service


class ServiceRegistry:
    """All services of one server; it has `available_services` and `openapi` itself."""

    def __init__(self, services: Iterable[Service] = (), clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._by_path: dict[str, Service] = {}
        self._paths: dict[str, str] = {}  # by name
        self._left: dict[str, int] = {}  # calls, by name
        self._ends: dict[str, float] = {}  # time, by name

        @service
        async def available_services() -> dict[str, Any]:
            """List the services with their parameters."""
            return {"services": [item.describe() for item in self]}

        @service
        async def openapi() -> dict[str, Any]:
            """Describe the services as an OpenAPI 3.1 document."""
            return document(self)

        for item in (available_services, openapi, *services):
            self.add(item)

    def __iter__(self) -> Iterator[Service]:
        here = [item for name in list(self._paths) if (item := self._here(self._paths[name])) is not None]
        return iter(sorted(here, key=lambda item: item.name))

    def add(self, item: Service) -> None:
        """Bind a service to its URL; its ttl and lifetime begin.

        :raises ValueError: when name or path is taken
        """
        if self._here(self._paths.get(item.name, "")) or self._here(item.path):
            raise ValueError(f"cannot add service {item.name}: the name is taken")
        self._paths[item.name] = item.path
        self._by_path[item.path] = item
        if item.ttl is not None:
            self._left[item.name] = item.ttl
        if item.lifetime is not None:
            self._ends[item.name] = self._clock() + item.lifetime

    def remove(self, name: str) -> Service:
        """Unbind a service (Hop's `unregister`); calls that run go on.

        :raises Refused: with status 404, when there is none
        """
        item = self.get(name)
        self._forget(item)
        return item

    def move(self, name: str, path: str) -> None:
        """Bind a service to another path instead.

        :raises Refused: with status 404, when there is none
        :raises ValueError: when the path is taken
        """
        item = self.get(name)
        if self._here(check_path(path)) is not None:
            raise ValueError(f"cannot move service {name}: {path} is taken")
        del self._by_path[item.path]
        self._by_path[path] = replace(item, path=path)
        self._paths[name] = path

    def get(self, name: str) -> Service:
        """Return the service of that name.

        :raises Refused: with status 404, when there is none
        """
        return self._found(self._paths.get(name, ""), name)

    def at(self, path: str) -> Service:
        """Return the service at that path; a slash at its end does not count.

        :raises Refused: with status 404, when there is none
        """
        item = self._by_path.get(path)
        if item is not None and not self._ends:
            return item
        return self._found(path.rstrip("/"), path.removeprefix(BASE))

    def spend(self, item: Service) -> None:
        """Count one call.

        :raises Refused: with status 404, when the service has had its calls
        """
        if item.ttl is None:
            return
        if item.name not in self._left:  # it was here when the head of the request came
            raise _unknown(item.name)
        self._left[item.name] -= 1
        if self._left[item.name] <= 0:
            self._forget(item)

    def _found(self, path: str, name: str) -> Service:
        item = self._here(path)
        if item is None:
            raise _unknown(name)
        return item

    def _here(self, path: str) -> Service | None:
        item = self._by_path.get(path)
        if item is not None and self._clock() >= self._ends.get(item.name, math.inf):
            self._forget(item)
            return None
        return item

    def _forget(self, item: Service) -> None:
        self._by_path.pop(item.path, None)
        for book in (self._paths, self._left, self._ends):
            book.pop(item.name, None)


def _unknown(name: str) -> Refused:
    return Refused(f"cannot find a service {name[:70]!r}: see /hop/available_services", 404)
