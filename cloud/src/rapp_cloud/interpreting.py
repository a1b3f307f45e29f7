"""Interpretation in worker processes: what RApps add to the catalogue is learnt before anybody says it."""

import asyncio
import logging
from collections.abc import Callable
from itertools import chain
from pathlib import Path

from rapp_cloud.interpreter.port import Commands, Interpretation
from rapp_cloud.views import Manifests
from rapp_hop.errors import HopError
from rapp_hop.workers import Workers

_AT_ONCE = 64  # sentences that one worker learns, some tenths of a second, before others have their turn
_PERIOD = 2.0  # seconds between two looks for new RApps
_log = logging.getLogger(__name__)


class Interpreting:
    """Asks the workers of one platform; call it as an `services.voice.Interpret`."""

    def __init__(self, workers: Workers, timeout: float) -> None:
        """Take the workers.

        :param timeout: seconds for one recording
        """
        self._workers = workers
        self._timeout = timeout
        self._learnt: dict[str, set[str]] = {}  # by language
        self._last: Commands | None = None
        self._learning: asyncio.Task[None] | None = None

    async def __call__(self, recording: Path, commands: Commands, language: str) -> Interpretation:
        """Interpret a recording, once all that it can mean has been learnt."""
        await self._learn(commands, language)
        found: Interpretation = await self._workers.run("interpret", recording, commands, language, timeout=self._timeout)
        return found

    async def keep_learning(self, manifests: Callable[[], Manifests]) -> None:
        """Learn what is on offer, and what comes, until cancelled."""
        known: Manifests | None = None
        try:
            while True:
                pause = self._timeout
                try:
                    offered = await asyncio.to_thread(manifests)
                    if offered is not known:
                        for language in sorted({language for manifest in offered for language in manifest.sentences}):
                            await self._learn(_spoken(offered, language), language)
                    known, pause = offered, _PERIOD
                except HopError as error:
                    _log.error("%s; what is new in the store is learnt later", error)
                except Exception:  # noqa: BLE001 (a worker's own, of any kind; nobody waits for this task)
                    _log.exception("what is new in the store could not be learnt, and is later")
                await asyncio.sleep(pause)
        finally:
            if self._learning is not None:
                self._learning.cancel()

    async def _learn(self, commands: Commands, language: str) -> None:
        while new := self._missing(commands, language):
            if self._learning is None or self._learning.done():
                self._learning = asyncio.create_task(self._work(new, language))
            await asyncio.shield(self._learning)  # whoever gives up waiting must not end it for the others
        self._last = commands

    def _missing(self, commands: Commands, language: str) -> list[str]:
        if commands is self._last:
            return []
        known = self._learnt.get(language, set())  # a language is entered when it was learnt, not when somebody names it
        return [text for text in dict.fromkeys(chain.from_iterable(commands.values())) if text not in known]

    async def _work(self, sentences: list[str], language: str) -> None:
        for first in range(0, len(sentences), _AT_ONCE):
            part = sentences[first : first + _AT_ONCE]
            await self._workers.run("learn", part, language, timeout=self._timeout)
            self._learnt.setdefault(language, set()).update(part)


def _spoken(offered: Manifests, language: str) -> Commands:
    return {f"{each.name} {each.version}": each.sentences.get(language, ()) for each in offered}
