"""The door of a server: one connection at a time, and on when the system has no descriptor left."""

import asyncio
import errno
import socket
from typing import Any

from rapp_hop import accepting
from rapp_hop.accepting import Door


class Listening(socket.socket):
    """A socket that cannot accept for a while, as when all descriptors are in use."""

    failures = 0

    def accept(self) -> tuple[socket.socket, Any]:
        if self.failures:
            self.failures -= 1
            raise OSError(errno.EMFILE, "Too many open files")
        return super().accept()


def listening() -> Listening:
    found = Listening()
    found.bind(("127.0.0.1", 0))
    found.listen(16)
    return found


def test_connections_come_one_at_a_time_and_wait_out_a_lack_of_descriptors(monkeypatch: Any) -> None:
    monkeypatch.setattr(accepting, "PAUSE", 0.02)

    async def main() -> None:
        taken: asyncio.Queue[int] = asyncio.Queue()
        place = listening()
        place.failures = 3

        def take(connection: socket.socket, _peer: Any) -> None:
            taken.put_nowait(connection.getpeername()[1])
            connection.close()

        door = Door(place, take)
        callers = [socket.create_connection(place.getsockname(), 10) for _ in range(5)]
        async with asyncio.timeout(20):
            found = [await taken.get() for _ in callers]
        assert found == [caller.getsockname()[1] for caller in callers]
        door.close()
        for caller in callers:
            caller.close()

    asyncio.run(main())


def test_a_door_closes_while_it_pauses() -> None:
    async def main() -> None:
        place = listening()
        place.failures = 10**6
        door = Door(place, lambda *_: None)
        with socket.create_connection(place.getsockname(), 10):
            async with asyncio.timeout(20):
                while door._pause is None:
                    await asyncio.sleep(0.01)
            door.close()
        assert place.fileno() == -1

    asyncio.run(main())
