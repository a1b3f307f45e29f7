"""Cloud agents made for one test: their packages, and a platform's side for them without the rest of it."""

import asyncio
import json
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from rapp_cloud.cloud_agents.doors import Doors
from rapp_cloud.cloud_agents.engine import LocalProcesses
from rapp_cloud.cloud_agents.port import Order
from rapp_cloud.cloud_agents.process import LocalAgent
from rapp_cloud.cloud_agents.sandbox import Limits
from rapp_hop.errors import from_wire
from rapp_hop.protocol import WireRequest
from rapp_hop.registry import ServiceRegistry
from rapp_hop.server import HopServer
from rapp_hop.service import Request, service

PROBE = """
import asyncio, os, signal, socket, sys, time
from pathlib import Path
from typing import Any
from rapp_hop.cloud_agent import HopError, repository, service


@service
async def ask(name: str, args: dict = {}) -> Any:
    return await repository.call(name, args, timeout=5)


@service(timeout=60)
def run(code: str) -> Any:
    space = dict(globals())
    exec(code, space)
    return space.get("facts")


@service(timeout=60)
async def run_in_loop(code: str) -> Any:
    space = dict(globals())
    exec(code, space)
    return space.get("facts")


@service(max_body=16 * 2**20)
def measure(picture: Path, times: int = 1) -> dict:
    return {"size": picture.stat().st_size * times, "ending": picture.suffix}
"""
"""A program that runs what a test wants to know from inside."""


def write_cloud_agent(folder: Path, name: str, program: str = PROBE, version: str = "1.0.0", **rapp: Any) -> Path:
    """A package of a cloud agent; gives its folder."""
    folder.mkdir(parents=True)
    manifest = {
        "name": name,
        "version": version,
        "description": "made for a test",
        "rapp": {"agent": "cloud", "entry": "agent.py", "runtime": "python3", "permissions": {"core": [], "cloud": []}, **rapp},
    }
    (folder / "package.json").write_text(json.dumps(manifest))
    (folder / "agent.py").write_text(program)
    return folder


@service
async def greet(request: Request, name: str = "") -> dict[str, str]:
    """A service of the platform that says who calls."""
    return {"caller": request.caller, "name": name}


@service
async def secret() -> str:
    """A service of the platform that no package may call in these tests."""
    return "secret"


@service
def weigh(file: Path) -> int:
    """A service of the platform that takes a file."""
    return file.stat().st_size


class Workshop:
    """An engine, a platform's server of the services `greet`, `weigh` and `secret`, and probes."""

    def __init__(self, folder: Path, limits: Limits | None = None) -> None:
        """Prepare; needs a running loop."""
        self.folder = folder
        self.doors = Doors(folder / "agents", folder / "uploads", lambda _token: None)
        self.server = HopServer(ServiceRegistry([greet, secret, weigh]), self.doors.caller, folder / "uploads")
        self.server.listen_unix(self.doors.platform)
        self.port = self.server.listen(0)
        self.engine = LocalProcesses(folder / "agents", self.doors.open, limits)
        self._count = 0

    async def start(self, program: str = PROBE, services: tuple[str, ...] = ("greet", "weigh"), robot: str = "nao") -> LocalAgent:
        """A cloud agent of that program."""
        self._count += 1
        package = write_cloud_agent(self.folder / f"package-{self._count}", "probe", program)
        return await self.engine.start(Order(robot, f"r{self._count}", "probe", package, "agent.py", {}, frozenset(services)))

    async def close(self) -> None:
        """End everything."""
        await self.engine.close()
        await self.server.close()
        self.doors.close()


async def call(agent: LocalAgent, service_name: str, /, **arguments: Any) -> Any:
    """Call a service of a cloud agent; gives its result. Raises HopError."""
    head = {"content-type": "application/json"}
    request = WireRequest("POST", f"/hop/{service_name}", head, json.dumps(arguments).encode())
    answer = await agent.send(request, request.path, 60.0)
    assert isinstance(answer.body, bytes)
    found = json.loads(answer.body)
    if answer.status != 200:
        raise from_wire(found["error"]["kind"], found["error"]["message"], answer.status)
    return found


Test = Callable[[Workshop], Coroutine[Any, Any, None]]


def in_workshop(folder: Path, test: Test, limits: Limits | None = None) -> None:
    """Run a test in a workshop of its own."""

    async def main() -> None:
        shop = Workshop(folder, limits)
        await shop.engine.open()
        try:
            await test(shop)
        finally:
            await shop.close()

    asyncio.run(main())


async def until(done: Callable[[], bool], seconds: float = 30.0) -> None:
    """Wait for something that nobody tells."""
    async with asyncio.timeout(seconds):
        while not done():
            await asyncio.sleep(0.02)
