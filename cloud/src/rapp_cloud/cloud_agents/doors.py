"""The way of cloud agents to a_rep: a UNIX socket for each, on which only the services that its package names are served.

A call is relayed to the platform's own server over a socket that nobody else reaches, with a secret in the place of the robot's
token: so the platform's limits hold for all callers together, and a service sees the robot as the caller.
"""

import os
import secrets
from pathlib import Path

from rapp_hop.client import CLIENTS
from rapp_hop.errors import Refused
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer, turned_away
from rapp_hop.registry import ServiceRegistry
from rapp_hop.relay import relay
from rapp_hop.server import HopServer, ServerLimits
from rapp_hop.service import Authenticate

MAX_CALL = 32 * 2**20  # bytes of a call with its files
CALLS = 16  # of one agent at once
LIMITS = ServerLimits(connections=CLIENTS, spooled=2 * MAX_CALL)  # of one door: what an agent fills is its own
LONGEST_CALL = 600.0  # s; a service's own time is shorter
SOCKET = "platform.socket"
EVERYBODY = 0o666  # may connect: the socket is bound into one sandbox only, whose account differs from ours


class Door:
    """One agent's socket."""

    def __init__(self, house: "Doors", secret: str, services: frozenset[str], path: Path) -> None:
        """Serve on a UNIX socket at `path`."""
        self._house = house
        self._secret = secret
        self._services = services
        self._calls = 0
        mount = Mount("/hop/", self._pass, max_body=MAX_CALL)
        self._server = HopServer(ServiceRegistry([]), lambda _token: "cloud agent", house.uploads, [mount], LIMITS)
        self._server.listen_unix(path, EVERYBODY)

    async def close(self) -> None:
        """Serve no more; the secret is of no use any longer."""
        self._house.forget(self._secret)
        await self._server.close()

    async def _pass(self, visit: Visit) -> WireAnswer:
        if visit.rest not in self._services:
            raise Refused(f"cannot call {visit.rest[:70]!r}: the package does not name it under permissions.cloud", 403)
        if self._calls >= CALLS:
            raise turned_away(f"cannot call {visit.rest} now: {CALLS} calls of this cloud agent are open, try again later")
        self._calls += 1
        try:
            return await relay(self._house.platform, visit.request, visit.request.path, LONGEST_CALL, self._secret)
        finally:
            self._calls -= 1


class Doors:
    """All of them, and the platform's socket, on which its server is to serve; undone by `close`."""

    def __init__(self, folder: Path, uploads: Path, authenticate: Authenticate) -> None:
        """Prepare.

        :param folder: for the platform's own socket; made when it is not there
        :param authenticate: from robots' tokens to robots
        """
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        # Through the open folder the socket is reached however long its path is: it may only have 107 bytes.
        self._place = os.open(folder, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
        self.platform = Path(f"/proc/self/fd/{self._place}/{SOCKET}")
        self.uploads = uploads
        self._authenticate = authenticate
        self._robots: dict[str, str] = {}  # by secret

    def open(self, robot: str, services: frozenset[str], path: Path) -> Door:
        """Open the door of one agent; see `process.Serve`."""
        secret = secrets.token_urlsafe(32)
        self._robots[secret] = robot
        return Door(self, secret, services, path)

    def close(self) -> None:
        """Let the folder go; no door is open any more."""
        os.close(self._place)

    def forget(self, secret: str) -> None:
        """Close a door."""
        self._robots.pop(secret, None)

    def caller(self, token: str | None) -> str | None:
        """Return the robot of a token, or of a door's secret."""
        return self._robots.get(token) or self._authenticate(token) if token else None
