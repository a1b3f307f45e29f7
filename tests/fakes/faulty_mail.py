"""The way from link to mail server, with faults at each command of SMTP. The server behind it is the real one."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from fakes.line import LOOPBACK, MOST, Line, Pair

CUT = ""  # in place of a reply: the connection ends
HELD = "held"  # in place of a reply: none comes


@dataclass(frozen=True)
class Fault:
    """At a command (CONNECT, EHLO, AUTH, MAIL, RCPT, DATA, or CONTENT: the end of the mail) the client gets `reply` instead.

    :param seen: whether the server has had the command, and its reply is lost
    """

    at: str
    reply: str = CUT
    seen: bool = False


NONE = Fault("never")
AWAY = Fault("CONNECT")
NO_RECIPIENT = Fault("RCPT", "550 5.1.1 no such mailbox")
LATER = Fault("RCPT", "451 4.3.0 try again later")
NO_LOGIN = Fault("AUTH", "535 5.7.8 wrong name or password")
LOST_AFTER_DATA = Fault("CONTENT", CUT, seen=True)
Choose = Callable[[], Fault]


class FaultyMail(Line):
    """Asks `choose` at each connection; `login`: offers AUTH, and answers it itself."""

    def __init__(self, beyond: int, choose: Choose = lambda: NONE, login: bool = False) -> None:
        self.choose = choose
        self.login = login
        self.met: list[Fault] = []
        self.sent: list[bytes] = []  # contents of mails that have come to the server
        super().__init__(beyond)

    async def relay(self, client: Pair) -> None:
        fault = self.choose()
        server = await asyncio.open_connection(LOOPBACK, self.beyond, limit=MOST)
        try:
            await _Talk(client, server, fault, self).go()
        finally:
            server[1].close()


class _Talk:
    """One connection: command, reply, command, reply."""

    def __init__(self, client: Pair, server: Pair, fault: Fault, line: FaultyMail) -> None:
        self._client, self._server, self._fault, self._line = client, server, fault, line

    async def go(self) -> None:
        if not await self._answer("CONNECT", b""):
            return
        while line := await self._client[0].readline():
            command = line[:4].decode("ascii", "replace").upper().strip()
            if not await self._answer(command, line):
                return
            if command == "DATA" and self._fault.at != "DATA" and not await self._answer("CONTENT", await self._content()):
                return

    async def _content(self) -> bytes:
        return await self._client[0].readuntil(b"\r\n.\r\n")

    async def _answer(self, command: str, data: bytes) -> bool:
        """Hand a command on and the reply back; False when the connection is over."""
        fault = self._fault if self._fault.at == command else None
        if fault is not None:
            self._line.met.append(fault)
        if command == "AUTH" and self._line.login:
            await self._reply(b"235 2.7.0 welcome\r\n" if fault is None else fault.reply.encode() + b"\r\n")
            return True
        reply = b"" if fault is not None and not fault.seen else await self._ask(data)
        if command == "CONTENT" and reply:
            self._line.sent.append(data)
        if fault is None:
            await self._reply(_with_login(reply) if command == "EHLO" and self._line.login else reply)
            return True
        if fault.reply == HELD:
            await asyncio.Event().wait()
        if fault.reply == CUT:
            return False
        await self._reply(fault.reply.encode() + b"\r\n")
        return True

    async def _ask(self, data: bytes) -> bytes:
        self._server[1].write(data)
        await self._server[1].drain()
        reply = line = await self._server[0].readline()
        while line[3:4] == b"-":
            line = await self._server[0].readline()
            reply += line
        return reply

    async def _reply(self, data: bytes) -> None:
        self._client[1].write(data)
        await self._client[1].drain()


def _with_login(reply: bytes) -> bytes:
    first, _, rest = reply.partition(b"\r\n")
    return b"250-" + first[4:] + b"\r\n250-AUTH PLAIN\r\n" + rest if rest else reply
