"""The platform put together: parts made from one config, started, served, ended in reverse order."""

import asyncio
import logging
import shutil
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from rapp_cloud.certificate import Certificate
from rapp_cloud.cloud_agents.agents import CloudAgents, Quota
from rapp_cloud.cloud_agents.doors import Doors
from rapp_cloud.cloud_agents.engine import LocalProcesses
from rapp_cloud.cloud_agents.packages import Packages
from rapp_cloud.config import CloudConfig
from rapp_cloud.entrance import entrance
from rapp_cloud.health import checks_of, health
from rapp_cloud.interpreter.port import Interpreter
from rapp_cloud.interpreting import Interpreting
from rapp_cloud.keys import Passphrase
from rapp_cloud.memory import Memory, remembering
from rapp_cloud.metrics import MeasuredServer, Metrics
from rapp_cloud.robots import Robots
from rapp_cloud.runs_page import runs_page
from rapp_cloud.services.agents import agent_calls, agent_services
from rapp_cloud.services.people import people_services
from rapp_cloud.services.presence import presence_services
from rapp_cloud.services.publishing import publishing_services
from rapp_cloud.services.runs import run_services
from rapp_cloud.services.sight import sight_services
from rapp_cloud.services.voice import voice_services
from rapp_cloud.shelf import Shelf
from rapp_cloud.static import store_files
from rapp_cloud.store_page import store_page
from rapp_cloud.turnstile import Turnstile
from rapp_cloud.views import Views
from rapp_cloud.weblets import weblets
from rapp_cloud.witness import note_offers, noted
from rapp_hop.errors import HopError
from rapp_hop.hz.archive import build
from rapp_hop.registry import ServiceRegistry
from rapp_hop.workers import Workers

_log = logging.getLogger(__name__)


def open_shelf(data: Path, passphrase: Passphrase | None = None) -> Shelf:
    """Return the store of a data folder."""
    return Shelf(data / "tuf", data / "keys", passphrase=passphrase)


def load_interpreter(cache: Path) -> Interpreter:
    """Load the interpreter; runs in a worker process, so only there its models and libraries are loaded."""
    from rapp_cloud.interpreter.hearing import make_interpreter

    return make_interpreter(cache)


@asynccontextmanager
async def running_cloud(config: CloudConfig) -> AsyncIterator[int]:
    """Start the platform and give its port; end it when the block ends.

    :raises HopError: when the store, a source to publish or the port is not as it must be
    """
    shelf = open_shelf(config.data, Passphrase(config.passphrase, config.passphrase_file))
    await asyncio.to_thread(shelf.refresh)
    robots = Robots(time.monotonic, config.lease)
    async with remembering(config.data, config.database, robots) as memory:
        await asyncio.to_thread(_prepare, shelf, config, memory)
        async with _serving(config, shelf, robots, memory) as port:
            yield port


@asynccontextmanager
async def _serving(config: CloudConfig, shelf: Shelf, robots: Robots, memory: Memory) -> AsyncIterator[int]:
    workers = Workers(load_interpreter, config.workers, arguments=(config.data / "cache",))
    interpreting = Interpreting(workers, config.interpret_timeout)
    doors = Doors(config.data / "agents", config.data / "uploads", memory.accounts.name_of)
    agents = _cloud_agents(config, shelf, robots, doors)
    certificate = Certificate(*config.tls_files) if config.tls_files else None
    metrics = _metrics(robots, agents, certificate)
    checks = checks_of(memory, config.data, shelf.metadata / "timestamp.json", certificate)
    registry = _registry(config, shelf, interpreting, robots, agents, memory)
    turnstile = Turnstile(memory.accounts, memory.quotas, time.monotonic)
    server = MeasuredServer(metrics, turnstile.admit, registry, doors.caller, config.data / "uploads", [
        *entrance(memory.admission, memory.audit),
        *health(checks, metrics, memory.accounts.name_of, certificate),
        turnstile.counted(store_files("/tuf/metadata/", shelf.metadata)),
        turnstile.counted(noted(store_files("/tuf/targets/", shelf.targets), memory)),
        runs_page(),
        turnstile.counted(weblets(shelf, "https" if certificate else "http")),
        turnstile.counted(store_page(shelf)),
        agent_calls(agents),
    ], tls=certificate.context if certificate else None)  # fmt: skip
    keeping = [asyncio.create_task(_keep_fresh(shelf, config.refresh))]
    keeping += [asyncio.create_task(certificate.keep())] if certificate else []
    try:
        await workers.start()
        keeping.append(asyncio.create_task(interpreting.keep_learning(shelf.manifests)))
        await agents.open()
        server.listen_unix(doors.platform)
        yield server.listen(config.port, config.address)
    finally:
        for task in keeping:
            task.cancel()
        await asyncio.gather(*keeping, return_exceptions=True)
        await agents.close()
        await server.close()
        await workers.close()
        doors.close()


def _prepare(shelf: Shelf, config: CloudConfig, memory: Memory) -> None:
    shutil.rmtree(config.data / "uploads", ignore_errors=True)  # of calls that a crash cut short
    before = shelf.offers()
    for folder in config.publish:
        manifest = shelf.publish(build(folder))
        _log.info("on offer: %s %s", manifest.name, manifest.version)
    note_offers(memory.audit, before, shelf.offers())


def _cloud_agents(config: CloudConfig, shelf: Shelf, robots: Robots, doors: Doors) -> CloudAgents:
    folder = config.data / "agents"
    engine = LocalProcesses(folder, doors.open)
    return CloudAgents(engine, Packages(shelf, folder / "packages"), robots.is_here, Quota(config.agents_of_one, config.agents))


def _metrics(robots: Robots, agents: CloudAgents, certificate: Certificate | None) -> Metrics:
    metrics = Metrics()
    metrics.show("rapp_robots", "Robots whose lease holds", robots.count)
    metrics.show("rapp_cloud_agents", "Cloud agents that run", agents.count)
    if certificate:
        metrics.show("rapp_certificate_expires_seconds", "In how long the TLS certificate expires", certificate.left)
    return metrics


def _registry(
    config: CloudConfig, shelf: Shelf, interpreting: Interpreting, robots: Robots, agents: CloudAgents, memory: Memory
) -> ServiceRegistry:
    views = Views(shelf.believed)
    return ServiceRegistry(
        [
            *presence_services(robots, views),
            *people_services(memory.people),
            *run_services(memory.reports, memory.audit, memory.accounts),
            *voice_services(robots, views, interpreting),
            *agent_services(agents, robots),
            *sight_services(),
            *publishing_services(shelf.desk, memory.accounts, memory.audit, config.publisher_quota * 2**20),
        ]
    )


async def _keep_fresh(shelf: Shelf, period: float) -> None:
    while True:
        await asyncio.sleep(period)
        try:
            await asyncio.to_thread(shelf.refresh)
        except (HopError, OSError) as error:
            _log.error("cannot sign a new timestamp: %s", error)
