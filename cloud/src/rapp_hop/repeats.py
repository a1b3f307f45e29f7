"""A call with the header `Idempotency-Key` runs once: who sends it again gets the first one's answer (input H17)."""

import asyncio
import hashlib
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from rapp_hop.errors import Invalid, Refused
from rapp_hop.protocol import Body, WireAnswer

CAPACITY = 2048  # answers
KEEP = 300.0  # seconds
MAX_KEPT = 64 * 1024  # bytes of an answer


@dataclass
class _Entry:
    digest: bytes
    since: float
    answer: asyncio.Future[WireAnswer | None]  # None: it was too long to keep


class Repeats:
    """The answers of the last minutes, by caller, path and key."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._entries: OrderedDict[tuple[str, str, str], _Entry] = OrderedDict()

    async def once(self, caller: str, path: str, key: str, body: Body, run: Callable[[], Awaitable[WireAnswer]]) -> WireAnswer:
        """Return `run`'s answer, or that of the same call before.

        :raises Invalid: when the key is none
        :raises Refused: with status 409, when the key stood for another call, or its answer was too long to keep
        """
        if not 8 <= len(key) <= 128 or not key.isprintable():
            raise Invalid("cannot use this Idempotency-Key: it must have 8 to 128 characters")
        digest = await asyncio.to_thread(_digest, body) if len(body) > MAX_KEPT else _digest(body)
        place = (caller, path, key)
        entry = self._entries.get(place)
        if entry is not None and self._clock() - entry.since < KEEP:
            return await self._again(entry, digest)
        return await self._first(place, digest, run)

    async def _again(self, entry: _Entry, digest: bytes) -> WireAnswer:
        if entry.digest != digest:
            raise Refused("cannot repeat the call: its Idempotency-Key stood for other arguments", 409)
        answer = await asyncio.shield(entry.answer)
        if answer is None:
            raise Refused("cannot repeat the answer: it was too long to keep", 409)
        return answer

    async def _first(self, place: tuple[str, str, str], digest: bytes, run: Callable[[], Awaitable[WireAnswer]]) -> WireAnswer:
        entry = _Entry(digest, self._clock(), asyncio.get_running_loop().create_future())
        self._entries[place] = entry
        self._entries.move_to_end(place)
        self._forget_old()
        try:
            answer = await run()
        except BaseException:
            self._entries.pop(place, None)
            entry.answer.cancel()
            raise
        if any(name == "Retry-After" for name, _ in answer.headers):
            self._entries.pop(place, None)  # it was turned away and may come again
        kept = isinstance(answer.body, bytes) and len(answer.body) <= MAX_KEPT
        entry.answer.set_result(answer if kept else None)
        return answer

    def _forget_old(self) -> None:
        while len(self._entries) > CAPACITY:
            self._entries.popitem(last=False)


def _digest(body: Body) -> bytes:
    return hashlib.sha256(body).digest()
