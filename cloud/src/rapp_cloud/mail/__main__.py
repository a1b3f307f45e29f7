"""Entry point: reads the settings, serves SMTP until SIGINT or SIGTERM."""

import asyncio
import json
import logging
import signal
import sys

from rapp_cloud.mail.config import Config, read
from rapp_cloud.mail.errors import MailError
from rapp_cloud.mail.server import MailServer
from rapp_cloud.mail.users import add_user

_log = logging.getLogger("rapp_cloud.mail")


def main() -> int:
    """Run the mail server; gives the exit status."""
    config = read(sys.argv[1:])
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    logging.getLogger("mail.log").setLevel(logging.WARNING)  # aiosmtpd writes every command, AUTH among them
    try:
        if config.add_user and config.users_file:
            add_user(config.users_file, config.add_user, sys.stdin.readline().rstrip("\n"))
        else:
            asyncio.run(_serve(config))
    except MailError as error:
        _log.error("%s", error)
        return 1
    return 0


async def _serve(config: Config) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    server = MailServer(config)
    port = await server.start()
    try:
        print("READY " + json.dumps({"port": port}), flush=True)
        await stop.wait()
    finally:
        await server.stop()


if __name__ == "__main__":
    sys.exit(main())
