"""Entry point of the mail server: serves until SIGINT or SIGTERM."""

import asyncio
import json
import logging
import signal
import sys

from rapp_cloud.mail.config import MailConfig, read
from rapp_cloud.mail.maildir import Maildir
from rapp_cloud.mail.server import make_smtp


def main() -> int:
    """Run the server; gives the exit status."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    asyncio.run(_serve(read(sys.argv[1:])))
    return 0


async def _serve(config: MailConfig) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    maildir = Maildir(config.maildir)
    server = await loop.create_server(lambda: make_smtp(config, maildir), config.address, config.port)
    print("READY " + json.dumps({"port": server.sockets[0].getsockname()[1]}), flush=True)
    await stop.wait()
    server.close()


if __name__ == "__main__":
    sys.exit(main())
