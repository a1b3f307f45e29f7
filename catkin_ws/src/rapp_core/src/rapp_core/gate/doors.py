"""The gate's two sides: what a RApp's node connects to, and what the robot's nodes connect to for what the RApp publishes."""

import asyncio
import socket
import time
from collections.abc import Callable, Mapping
from typing import Any

from rapp_core.errors import CoreError, Refused, Unreachable
from rapp_core.gate.bounds import CONNECTION_RATE, CONNECTIONS, MESSAGE_RATE, Pace
from rapp_core.gate.inside import LOOPBACK, Inside
from rapp_core.gate.master import Master
from rapp_core.gate.questions import Outcome, Questions
from rapp_core.gate.relay import Doorway, Side, reach
from rapp_core.gate.rules import Rules
from rapp_core.gate.upstream import Upstream

PASSED = ("md5sum", "type", "message_definition", "persistent", "probe", "latching", "tcp_nodelay")
"""Fields of a connection header that a RApp may fill in; the name is the one that was judged."""


class Doors:
    """All connections of one run."""

    def __init__(self, upstream: Upstream, inside: Inside, master: Master, told: Callable[[str], None]) -> None:
        """`told` gets the URI of the gate's XMLRPC API towards the robot's nodes, once it is open."""
        self._upstream, self._inside, self._master, self._told = upstream, inside, master, told
        self._secret = ""
        self._pace = Pace(MESSAGE_RATE, time.monotonic)
        self._api = ""  # URI of our XMLRPC API towards the robot's nodes, once opened
        self._relay = 0  # port where those connect
        self._opening = asyncio.Lock()
        self._tasks: list[asyncio.Task[None]] = []

    def admit(self, rules: Rules, secret: str) -> None:
        """From now on the run may use these names; what passes carries the secret."""
        self._secret = secret
        self._master.rules, self._master.publish_api = rules, self._publish_api

    def serve(self, questions: socket.socket, relay: socket.socket) -> None:
        """Serve at the sandbox's listeners from now on."""
        self._begin(Questions(self._master.answer).serve(questions))
        self._begin(Doorway(relay, self._from_inside, CONNECTIONS, CONNECTION_RATE, self._pace).serve())

    async def close(self) -> None:
        """Serve no more, withdraw what was told the robot's master."""
        for task in self._tasks:
            task.cancel()
        if self._api:
            topics = list(self._master.publishers)
            await asyncio.gather(*(self._upstream.unregister(topic, self._api) for topic in topics), return_exceptions=True)

    def _begin(self, work: Any) -> None:
        self._tasks.append(asyncio.get_running_loop().create_task(work))

    # from the RApp to the robot

    async def _from_inside(self, caller: Side) -> None:
        """A node inside calls a service, or hears a topic."""
        asked = await caller.header()
        service, topic = asked.get("service", ""), asked.get("topic", "")
        rules = self._master.rules
        refusal = rules.subscribe(topic) if topic else rules.service(service)
        if refusal:
            raise Refused(self._master.refuse(refusal)[1])
        caller.mute = bool(topic)
        name = topic or service
        find = self._upstream.topic(topic, rules.core) if topic else self._upstream.service(service)
        try:
            called = await reach(await find)
        except Unreachable:
            self._upstream.forget(name)
            raise
        caller.send(await _greeted(called, {"topic" if topic else "service": name, **self._ours(asked)}))
        caller.join(called)

    # from the robot to what the RApp publishes

    async def _publish_api(self) -> str:
        """Open the doors towards the robot's nodes; they are opened when first needed."""
        async with self._opening:
            if not self._api:
                questions, relay = (_listener() for _ in range(2))
                self._relay = relay.getsockname()[1]
                self._begin(Questions(self._answer_robot).serve(questions))
                self._begin(Doorway(relay, self._from_robot, CONNECTIONS, CONNECTION_RATE, None).serve())
                self._api = f"http://{LOOPBACK}:{questions.getsockname()[1]}/"
                self._told(self._api)
        return self._api

    async def _answer_robot(self, method: str, words: list[Any]) -> Outcome:
        """The XMLRPC API of the run's node, as far as a publisher needs one."""
        if method == "requestTopic" and len(words) == 3:
            if words[1] in self._master.publishers:
                return 1, "", ["TCPROS", LOOPBACK, self._relay]
            return -1, f"cannot hear {words[1]}: it is not published here", []
        if method == "getPublications":
            return 1, "", [[topic, self._master.rules.publishes[topic]] for topic in self._master.publishers]
        return -1, f"cannot {method}: this is the gate of a RApp", 0

    async def _from_robot(self, hearer: Side) -> None:
        """A node of the robot wants to hear what the RApp publishes."""
        asked = await hearer.header()
        topic = asked.get("topic", "")
        port = self._master.publishers.get(topic)
        if port is None:
            raise Refused(f"cannot hear {topic[:200]}: it is not published here")
        connection, address = await self._inside.publisher(topic, port, self._upstream.node)
        called = await reach(address, connection, self._pace)
        hearer.send({"topic": topic, **self._ours(await _greeted(called, asked))})
        hearer.join(called)

    def _ours(self, fields: Mapping[str, str]) -> dict[str, str]:
        """A header from inside as it goes on: under the run's name, with the secret."""
        passed = {name: fields[name] for name in PASSED if name in fields}
        return {**passed, "callerid": self._upstream.node, "rapp_channel": self._secret}


async def _greeted(called: Side, asked: dict[str, str]) -> dict[str, str]:
    """Send the header to who is called; gives the answer. Raises CoreError, with what a refusal says."""
    called.send(asked)
    try:
        answer = await called.header()
        if "error" in answer:
            raise Refused(answer["error"])
    except CoreError:
        called.transport.close()
        raise
    return answer


def _listener() -> socket.socket:
    listener = socket.create_server((LOOPBACK, 0))
    listener.setblocking(False)
    return listener
