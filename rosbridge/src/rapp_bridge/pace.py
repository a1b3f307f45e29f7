"""Waits a moment for clients that are all behind, so that a burst is not lost which they would have read a moment later."""

import asyncio
from collections.abc import Callable, Iterable

from rapp_bridge.client import Client

MOMENT = 0.2  # s


class Pace:
    """Holds a topic's sources back while every client of it is behind; a client that has let them wait in vain is waited for
    no more until it has caught up. So no client can hold a publisher up for longer than a moment.
    """

    def __init__(self, hold: Callable[[bool], object]) -> None:
        """`hold` stops (True) and resumes (False) the reading of the topic's sources."""
        self._hold = hold
        self._timer: asyncio.TimerHandle | None = None

    def check(self, clients: Iterable[Client]) -> None:
        """A message has been offered to these clients."""
        if self._timer is None and all(client.is_behind for client in clients):
            waited_for = list(clients)
            self._hold(True)
            self._timer = asyncio.get_running_loop().call_later(MOMENT, self._in_vain, waited_for)
            for client in waited_for:
                client.when_caught_up(self._resume)

    def _in_vain(self, clients: list[Client]) -> None:
        if any(client.is_preparing for client in clients):  # it is the bridge that is slow, not they
            self._timer = asyncio.get_running_loop().call_later(MOMENT, self._in_vain, clients)
            return
        for client in clients:
            client.give_up()
        self._resume()

    def _resume(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self._hold(False)
