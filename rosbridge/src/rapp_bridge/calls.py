"""Calls of ROS services by clients, over pooled persistent connections, on the event loop."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

from rapp_bridge.blocking import Blocking
from rapp_bridge.config import Config
from rapp_bridge.conversion import arguments, writer
from rapp_bridge.errors import Unreachable
from rapp_bridge.master import Master
from rapp_bridge.tcpros import ServiceConnection


@dataclass
class _Line:
    """The connections to one service. They are opened one after another: rospy's servers listen with a backlog of 5,
    and a connection that finds it full waits a second for its next try.
    """

    free: asyncio.Semaphore
    opening: asyncio.Lock = field(default_factory=asyncio.Lock)
    idle: list[tuple[float, ServiceConnection]] = field(default_factory=list)  # loop time of opening; last used last
    users: int = 0


class Calls:
    """Calls of ROS services. A call is made once: when its fate is unknown it fails, and is never repeated."""

    def __init__(self, config: Config, master: Master, blocking: Blocking, caller: str) -> None:
        self._config = config
        self._master = master
        self._blocking = blocking
        self._caller = caller
        self._lines: dict[str, _Line] = {}

    async def call(self, name: str, values: list[Any] | dict[str, Any], timeout: float | None) -> dict[str, Any]:
        """Call the service of this resolved name; gives the response's fields. Raises BridgeError, in `timeout` seconds."""
        seconds = timeout or self._config.call_timeout
        try:
            async with asyncio.timeout(seconds), self._line(name) as line, line.free:
                return await self._through(name, line, values)
        except TimeoutError as error:
            raise Unreachable(f"cannot wait longer for {name}: no answer in {seconds:g} s") from error

    def close(self) -> None:
        """Close the idle connections."""
        for line in self._lines.values():
            for _, connection in line.idle:
                connection.close()
            line.idle.clear()

    @asynccontextmanager
    async def _line(self, name: str) -> AsyncIterator[_Line]:
        line = self._lines.setdefault(name, _Line(asyncio.Semaphore(self._config.connections)))
        line.users += 1
        try:
            yield line
        finally:
            line.users -= 1
            self._forget(name, line)

    def _forget(self, name: str, line: _Line) -> None:
        if not line.users and not line.idle:
            self._lines.pop(name, None)

    async def _through(self, name: str, line: _Line, values: list[Any] | dict[str, Any]) -> dict[str, Any]:
        born, connection = await self._connection(name, line)
        answered = False
        try:
            request = arguments(values, connection.type._request_class)
            response = await connection.call(request)
            answered = True
        finally:
            if answered:
                self._put_back(line, born, connection)
            else:
                connection.close()
        fields: dict[str, Any] = writer(connection.type._response_class)(response)
        return fields

    async def _connection(self, name: str, line: _Line) -> tuple[float, ServiceConnection]:
        if found := self._idle(line):
            return found
        async with line.opening:
            if found := self._idle(line):
                return found
            address = await self._blocking.run(self._master.service_address, name)
            connection = await ServiceConnection.open(name, address, self._caller, self._config.response_limit)
        loop = asyncio.get_running_loop()
        loop.call_later(self._config.connection_age, self._retire, name, line, connection)
        return loop.time(), connection

    @staticmethod
    def _idle(line: _Line) -> tuple[float, ServiceConnection] | None:
        while line.idle:
            born, connection = line.idle.pop()
            if connection.usable:
                return born, connection
            connection.close()
        return None

    def _put_back(self, line: _Line, born: float, connection: ServiceConnection) -> None:
        if asyncio.get_running_loop().time() - born < self._config.connection_age:
            line.idle.append((born, connection))
        else:
            connection.close()

    def _retire(self, name: str, line: _Line, connection: ServiceConnection) -> None:
        """Close an idle connection at its age; one in use is closed when it is put back."""
        for item in line.idle:
            if item[1] is connection:
                line.idle.remove(item)
                connection.close()
                break
        self._forget(name, line)
