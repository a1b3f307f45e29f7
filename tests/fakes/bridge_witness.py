"""A witness of hostile input to a bridge: connected before, and served afterwards as ever."""

import json
import ssl
import xmlrpc.client
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fakes.bridge_wire import Wire


@asynccontextmanager
async def witness(url: str, headers: dict[str, str] | None = None, tls: ssl.SSLContext | None = None) -> AsyncIterator[Wire]:
    """A client of its own, served before and after."""
    wire = await Wire.open(url, headers, tls)
    await served(wire)
    try:
        yield wire
        await served(wire)
    finally:
        wire.leave()


async def served(wire: Wire) -> None:
    """See that the client is served."""
    wire.send(op="call_service", service="/say", args=["as ever"], id="witness")
    while (answer := await wire.receive("service_response")).get("id") != "witness":
        pass
    assert answer["values"]["message"] == "as ever"


async def told(wire: Wire, words: str = "cannot ") -> None:
    """Wait for a status that says so, and see the connection served on."""
    while words not in (await wire.receive("status"))["msg"]:
        pass
    await wire.settle()


def known(master: str, name: str) -> bool:
    """Whether the ROS master has heard of a name."""
    return name in json.dumps(xmlrpc.client.ServerProxy(master).getSystemState("/test"))
