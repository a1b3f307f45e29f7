"""`./rapp remove NAME`: takes an installed RApp off the robot, by a job of the link, which alone installs and removes."""

import argparse
import asyncio
import json
import uuid
from typing import Any

from tornado.websocket import WebSocketClientConnection, WebSocketError, websocket_connect

from rapp_cli.errors import CommandError
from rapp_cli.home.place import Home, add_home_option, home_of
from rapp_core.config import Config
from rapp_core.control.quarantine import Quarantine
from rapp_hop.errors import HopError
from rapp_hop.hz.install import RappFolder

PATIENCE = 20.0  # s for all of it
AGAIN = 1.0  # s until the link is asked anew: it may just be starting, or its event was before the bridge had joined the topic
LONGEST = 4.0  # s between two such, which may all wait for an installation
MARGIN = 1.0  # s before the end at which the link gives up: nothing is removed once the caller was told that it is not
EVENTS = {"op": "subscribe", "topic": "/rapp_hop/events", "type": "rapp_msgs/HopEvent", "queue_length": 100}
DONE, FAILED = 1, 2  # kinds of a HopEvent


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp remove`."""
    parser.description = (
        "Removes an installed RApp (./rapp status lists them) from a robot that is up, with what is noted of its failures."
        " Its keepsakes and logs stay. Exit status: 0 removed, 1 not, as while it runs."
    )
    parser.add_argument("rapp", metavar="NAME")
    add_home_option(parser)


def run(options: argparse.Namespace) -> int:
    """Have the link remove it, and forget its failures. Raises CommandError."""
    home, name = home_of(options), options.rapp
    try:
        installed = RappFolder(home.robot / "rapps").find(name)
    except HopError as error:
        raise CommandError(f"cannot remove a RApp of this name: {error}") from error
    if installed is None:
        raise CommandError(f"cannot remove {name}: it is not installed; {home.command('status')} lists what is")
    try:
        asyncio.run(_remove(home.settled().bridge, name))
    except TimeoutError:
        raise CommandError(f"cannot remove {name}: the link does not answer; see {home.command('status')}") from None
    except (OSError, WebSocketError) as error:
        raise CommandError(f"cannot remove {name}: the robot is away ({error}); start it with {home.command('up')}") from error
    _forget_failures(home, name)
    kept = [str(path) for path in (home.robot / "keepsakes" / name, home.robot / "logs") if path.exists()]
    print(f"{name} {installed.version} is removed" + (f"; kept: {', '.join(kept)}" if kept else ""))
    return 0


async def _remove(bridge: str, name: str) -> None:
    """Ask until an event tells the end, with growing pauses; what is removed already may be removed again."""
    asked: set[str] = set()
    now, again = asyncio.get_running_loop().time, AGAIN
    end = now() + PATIENCE
    async with asyncio.timeout_at(end):
        socket = await websocket_connect(bridge, connect_timeout=PATIENCE)
        try:
            await socket.write_message(json.dumps(EVENTS))
            while True:
                asked.add(job := uuid.uuid4().hex)
                arguments = {"job": job, "arguments": json.dumps({"name": name}), "timeout": max(0.1, end - now() - MARGIN)}
                await socket.write_message(json.dumps({"op": "call_service", "service": "/rapp_hop/remove", "args": arguments}))
                try:
                    async with asyncio.timeout(again):
                        return await _ended(socket, asked)
                except TimeoutError:
                    again = min(2 * again, LONGEST)
        finally:
            socket.close()


async def _ended(socket: WebSocketClientConnection, asked: set[str]) -> None:
    """Read until one of the jobs has ended well. Raises CommandError with what the link says, OSError when the bridge leaves."""
    while (text := await socket.read_message()) is not None:
        message: dict[str, Any] = json.loads(text)
        if message["op"] == "service_response" and message["result"] and not message["values"]["accepted"]:
            raise CommandError(message["values"]["message"])
        event = message["msg"] if message["op"] == "publish" else {}  # the bridge's own status has a text there
        if event.get("job") in asked and event["kind"] == FAILED:
            raise CommandError(event["message"])
        if event.get("job") in asked and event["kind"] == DONE:
            return
    raise OSError("the rosbridge has left")


def _forget_failures(home: Home, name: str) -> None:
    try:
        Quarantine(Config(home=home.robot)).forget(name)
    except OSError as error:
        raise CommandError(f"cannot forget the failures of {name}, which is removed: {error}; make room, then retry it") from error
