"""What the gate asks of the robot's real ROS: where the permitted services and topics are. Each question has a bound."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from urllib.parse import urlsplit

from rapp_core.errors import Unreachable
from rapp_ros.master import MasterAwayError, ask

PATIENCE = 3.0  # s for the master, or the core agent's node, to answer
THREADS = 4  # that ask at once

Address = tuple[str, int]


class Upstream:
    """Questions under the run's own node name; what was found once is remembered for the run, until `forget`."""

    def __init__(self, master: str, node: str) -> None:
        """`master`: URI of the real one; `node`: what the run is called there."""
        self.node = node
        self._master = master
        self._known: dict[str, Address] = {}
        self._threads = ThreadPoolExecutor(THREADS, thread_name_prefix="ask")

    async def service(self, name: str) -> Address:
        """Where a service is; raises Unreachable."""
        if name not in self._known:
            self._known[name] = _address(await self._ask(self._master, "lookupService", name))
        return self._known[name]

    async def topic(self, name: str, publisher: str) -> Address:
        """Where that node publishes a topic; raises Unreachable."""
        if name not in self._known:
            api = await self._ask(self._master, "lookupNode", publisher)
            answer = await self._ask(str(api), "requestTopic", name, [["TCPROS"]])
            if not isinstance(answer, list) or len(answer) < 3:
                raise Unreachable(f"cannot hear {name}: {publisher} does not publish it")
            self._known[name] = (str(answer[1]), int(answer[2]))
        return self._known[name]

    def forget(self, name: str) -> None:
        """Ask anew the next time: nothing was there."""
        self._known.pop(name, None)

    async def register(self, topic: str, kind: str, api: str) -> None:
        """Tell the master that the run publishes a topic; raises Unreachable."""
        await self._ask(self._master, "registerPublisher", topic, kind, api)

    async def unregister(self, topic: str, api: str) -> None:
        """Undo `register`; raises Unreachable."""
        await self._ask(self._master, "unregisterPublisher", topic, api)

    async def _ask(self, uri: str, question: str, *words: Any) -> Any:
        def call() -> tuple[int, str, Any]:
            return ask(uri, PATIENCE, question, self.node, *words)

        try:
            code, text, value = await asyncio.get_running_loop().run_in_executor(self._threads, call)
        except (MasterAwayError, ValueError, TypeError) as error:
            raise Unreachable(str(error)) from error
        if code != 1:
            raise Unreachable(f"cannot {question} {words[0]}: {text}")
        return value


def _address(uri: Any) -> Address:
    try:
        parts = urlsplit(str(uri))
        if parts.hostname and parts.port:
            return parts.hostname, parts.port
    except ValueError:
        pass
    raise Unreachable(f"cannot go to {uri!r}: it is no address")
