"""Sends what lies in the outbox: at once when it is new, later with growing pauses, until the server has answered."""

import asyncio
import logging
import time
from collections import defaultdict
from collections.abc import Callable

from rapp_hop.errors import HopError, Refused
from rapp_link.config import MailConfig
from rapp_link.letter import Letter, Outcome
from rapp_link.outbox import Outbox
from rapp_link.smtp import Locked, Sender
from rapp_link.threads import in_thread

_log = logging.getLogger(__name__)


class Postman:
    """One mail at a time; new ones before those that failed."""

    def __init__(self, outbox: Outbox, sender: Sender, config: MailConfig, now: Callable[[], float] = time.time) -> None:
        """Prepare; `run` does the work.

        :param now: seconds since 1970
        """
        self._outbox = outbox
        self._sender = sender
        self._config = config
        self._now = now
        self._due: dict[str, float] = {}  # message id: loop time of the next try
        self._waiting: defaultdict[str, list[asyncio.Future[Letter]]] = defaultdict(list)
        self._wake = asyncio.Event()

    async def run(self) -> None:
        """Send until cancelled; begins with what an earlier process left."""
        loop = asyncio.get_running_loop()
        for letter in self._outbox.queued():
            self._due.setdefault(letter.message_id, loop.time())
        while True:
            self._wake.clear()
            message_id = min(self._due, key=lambda key: self._due[key], default=None)
            pause = None if message_id is None else self._due[message_id] - loop.time()
            if message_id is not None and pause is not None and pause <= 0:
                await self._try(message_id)
                continue
            try:
                async with asyncio.timeout(pause):
                    await self._wake.wait()
            except TimeoutError:
                continue

    async def deliver(self, letter: Letter, patience: float) -> Letter:
        """Have a mail of the outbox tried now and return it as it is after the try, or after `patience` seconds."""
        if letter.state != "queued":
            return letter
        tried: asyncio.Future[Letter] = asyncio.get_running_loop().create_future()
        self._waiting[letter.message_id].append(tried)
        self._due[letter.message_id] = float("-inf")
        self._wake.set()
        try:
            async with asyncio.timeout(patience):
                return await tried
        except TimeoutError:
            return self._outbox.find(letter.message_id) or letter

    async def _try(self, message_id: str) -> None:
        letter = self._outbox.find(message_id)
        del self._due[message_id]
        waiting = self._waiting.pop(message_id, [])
        if letter is not None and letter.state == "queued":
            letter = await self._send(letter)
            if letter.state == "queued":
                self._plan(letter)
        for tried in waiting + self._waiting.pop(message_id, []):
            if letter is not None and not tried.done():
                tried.set_result(letter)

    async def _send(self, letter: Letter) -> Letter:
        outcome = await self._ask_server(letter)
        after = letter.after(outcome)
        if after.state == "queued" and self._now() - letter.queued_at > self._config.give_up:
            after = after.after(Outcome(refused=dict.fromkeys(after.pending, "given up: tried for days")))
        try:
            await in_thread(self._outbox.update, after)
        except HopError as error:
            _log.error("%s", error)
        _log.info("mail %s: %s after %d tries", after.message_id, after.state, after.tries)
        if outcome.accepted:
            self._hurry()
        return after

    async def _ask_server(self, letter: Letter) -> Outcome:
        try:
            content = await in_thread(self._outbox.content, letter)
        except HopError as error:
            _log.error("%s", error)
            return Outcome()
        try:
            return await self._sender.send(letter.sender, letter.pending, content)
        except Refused as error:
            _log.error("%s", error)
            return Outcome(refused=dict.fromkeys(letter.pending, str(error)))
        except HopError as error:
            _log.warning("%s", error)
            return Outcome(later=dict.fromkeys(letter.pending, str(error)), locked=isinstance(error, Locked))

    def _plan(self, letter: Letter) -> None:
        pause = min(self._config.retry_first * 2.0 ** min(letter.tries - 1, 20), self._config.retry_most)
        self._due[letter.message_id] = asyncio.get_running_loop().time() + pause

    def _hurry(self) -> None:
        """Try the others now: the server is there again."""
        now = asyncio.get_running_loop().time()
        self._due = {message_id: min(due, now) for message_id, due in self._due.items()}
