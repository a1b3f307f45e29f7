"""Entry point of the link: builds the parts, serves until SIGINT or SIGTERM."""

import asyncio
import json
import logging
import signal
import sys

from rapp_hop.client import HopClient
from rapp_hop.hz.delivery import Delivery
from rapp_link import smtp
from rapp_link.commands import Commands
from rapp_link.config import Config, read
from rapp_link.jobs import Jobs
from rapp_link.outbox import Outbox
from rapp_link.reports import Reports
from rapp_link.ros_side import RosSide

_log = logging.getLogger(__name__)


def main() -> int:
    """Run the link; gives the exit status."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    try:
        config = read(sys.argv[1:])
        token = config.token_file.read_text().strip() if config.token_file else None
        root = config.root_file.read_bytes() if config.root_file else None
    except (OSError, ValueError) as error:
        _log.error("cannot start: %s; check the options", error)
        return 2
    asyncio.run(_serve(config, token, root))
    return 0


async def _serve(config: Config, token: str | None, root: bytes | None) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    client = HopClient(config.cloud, token)
    outbox = Outbox(config.home / "outbox", lambda recipients, content: smtp.send(config.smtp, recipients, content))
    delivery = Delivery(client, root, config.home) if root is not None else None
    commands = Commands(config, client, delivery, outbox, Reports(config.home / "reports"))
    ros = RosSide(config.bridge, loop)
    jobs = Jobs(commands.table(), ros, config.jobs)
    async with asyncio.TaskGroup() as tasks:
        work = [
            tasks.create_task(_live(config, ros, commands, jobs)),
            tasks.create_task(commands.keep_sending()),
            tasks.create_task(commands.keep_registered()),
        ]
        await stop.wait()
        jobs.cancel_all()
        for task in work:
            task.cancel()
    await client.close()
    await ros.close()


async def _live(config: Config, ros: RosSide, commands: Commands, jobs: Jobs) -> None:
    """Offer the services, then publish signs of life."""
    await ros.connect()
    ros.offer(commands.table(), jobs)
    print("READY " + json.dumps({"bridge": config.bridge}), flush=True)
    while True:
        ros.sign_of_life(commands.cloud_present)
        await asyncio.sleep(config.alive_period)


if __name__ == "__main__":
    sys.exit(main())
