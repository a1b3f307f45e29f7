"""All that the author of a cloud agent imports (deliverable section 3.2): what the dynamic agent may call, and the platform.

    from pathlib import Path
    from rapp_hop.cloud_agent import repository, service

    @service
    async def look(picture: Path) -> dict:
        found = await repository.call("qr_detection", {"file": picture})
        return {"seen": found}

Every `@service` of the program is served to the dynamic agent of the same run, and to nobody else. Working directory is a private
folder in memory. There is no network but these two ways.
"""

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rapp_hop.client import HopClient
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.service import Request, service

__all__ = [
    "Bug", "HopError", "Invalid", "Refused", "Repository", "Request", "Unreachable", "repository", "service",
]  # fmt: skip


class Repository:
    """The repository agent, as far as the package's `permissions.cloud` goes."""

    def __init__(self) -> None:
        """Know nobody yet; the runner connects."""
        self._client: HopClient | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    async def call(self, name: str, args: Mapping[str, Any] | None = None, timeout: float = 30.0) -> Any:
        """Call a service of the repository agent; a `Path` among the arguments is sent as a file.

        :param timeout: seconds
        :raises HopError: a leaf by what to do next; Refused when the package does not name the service
        """
        if self._client is None:
            raise Bug("cannot reach the platform: this program was not started by it")
        given = dict(args or {})
        files = {key: value for key, value in given.items() if isinstance(value, Path)}
        plain = {key: value for key, value in given.items() if key not in files}
        return await self._client.call(name, plain, files, timeout)

    def call_wait(self, name: str, args: Mapping[str, Any] | None = None, timeout: float = 30.0) -> Any:
        """As `call`, for services that are plain functions: waits for the result."""
        if self._loop is None:
            raise Bug("cannot reach the platform: this program was not started by it")
        return asyncio.run_coroutine_threadsafe(self.call(name, args, timeout), self._loop).result()

    def connect(self, platform: Path) -> HopClient:
        """Reach the platform through its socket, from the running loop; gives what is to be closed at the end."""
        self._loop = asyncio.get_running_loop()
        self._client = HopClient("http://a_rep", socket_path=platform)
        return self._client


repository = Repository()
