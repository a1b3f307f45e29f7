"""Entry point: reads the settings, joins rosbridge, platform and mail server until SIGINT or SIGTERM."""

import asyncio
import json
import logging
import os
import signal
import sys
import threading
import uuid
from pathlib import Path

from rapp_hop.errors import HopError, Refused
from rapp_hop.hz.delivery import Delivery, DeliveryLimits
from rapp_link.agents import CloudAgents
from rapp_link.cloud_side import Platform
from rapp_link.commands import Commands, sign_of_life
from rapp_link.config import Config, read
from rapp_link.events import message
from rapp_link.jobs import JobTable
from rapp_link.office import Office
from rapp_link.outbox import Outbox
from rapp_link.postman import Postman
from rapp_link.reports import Reports
from rapp_link.ros_side import RosSide
from rapp_link.smtp import SmtpSender
from rapp_link.telling import TellingClient, TellingSender

LAST_WORD = 1.8  # seconds from the signal to the end, whatever a thread still does

_log = logging.getLogger("rapp_link")


class Link:
    """All parts of the link, built from its settings."""

    def __init__(self, config: Config) -> None:
        """Build inside a running loop; opens no connection yet.

        :raises HopError: a setting is wrong or the disk refuses
        """
        own = config.home / "link"
        _make_home(own)
        self.config = config
        self.boot = uuid.uuid4().hex
        self.client = TellingClient(config.cloud, config.token or None, self._tell, config.cloud_ca_file)
        reports = Reports(own / "reports")
        self.outbox = outbox = Outbox(own / "outbox", config.mail.waiting)
        self.platform = Platform(self.client, config, reports)
        self.postman = Postman(outbox, TellingSender(SmtpSender(config.mail), self._tell), config.mail)
        limits = DeliveryLimits(quota=config.quota)
        self.delivery = Delivery(self.client, config.root, config.home, limits) if config.root else None
        self.agents = CloudAgents(self.platform)
        commands = Commands(config, self.platform, self.delivery, outbox, self.postman, reports, self.agents).table()
        self.office = Office(JobTable(config.jobs, config.longest), commands, lambda event: self.ros.tell(event))
        self.ros = RosSide(config.bridge, list(commands), self.office.request, self.office.cancel, self.agents.keep)

    async def run(self, stop: asyncio.Event) -> None:
        """Serve until `stop` is set."""
        await self._tidy()
        self.ros.open()
        try:
            async with asyncio.TaskGroup() as group:
                tasks = [group.create_task(self.platform.run()), group.create_task(self.agents.run())]
                if self.config.mail.host:
                    tasks.append(group.create_task(self.postman.run()))
                life = sign_of_life(self.ros.alive, self.platform, self.outbox, self.boot, self.config.alive)
                tasks.append(group.create_task(life))
                print("READY " + json.dumps({"boot": self.boot, "bridge": self.config.bridge}), flush=True)
                await stop.wait()
                for task in tasks:
                    task.cancel()
        finally:
            await self.office.close()
            await self.ros.close()
            await self.client.close()

    async def _tidy(self) -> None:
        """Remove what an installation has left that was cut off; a disk that refuses is told again at the next one."""
        try:
            if self.delivery is not None:
                await self.delivery.tidy()
        except HopError as error:
            _log.warning("%s", error)

    def _tell(self, text: str) -> None:
        self.ros.tell(message(text))


def main() -> int:
    """Run the link; gives the exit status."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    for name in ("roslibpy", "twisted"):  # they write a line at every attempt to connect
        logging.getLogger(name).setLevel(logging.ERROR)
    try:
        asyncio.run(_serve(read(sys.argv[1:])))
    except HopError as error:
        _log.error("%s", error)
        return 1
    return 0


async def _serve(config: Config) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, _begin_end, stop)
    await Link(config).run(stop)


def _begin_end(stop: asyncio.Event) -> None:
    # A name server or a disk that hangs holds a thread, and Python waits for its threads: not longer than this.
    last = threading.Timer(LAST_WORD, os._exit, (0,))
    last.daemon = True
    last.start()
    stop.set()


def _make_home(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as error:
        raise Refused(f"cannot use {folder}: {error.strerror}, give another --home") from None


if __name__ == "__main__":
    sys.exit(main())
