"""The mail half of the link as a process of its own: requests as JSON lines on stdin, events as JSON lines on stdout.

All parts are the link's; only its ROS side is left out. Started as `python mail_half.py HOME SMTP_PORT`.
"""

import asyncio
import json
import sys
from pathlib import Path

from rapp_hop.client import HopClient
from rapp_hop.errors import HopError
from rapp_link.agents import CloudAgents
from rapp_link.cloud_side import Platform
from rapp_link.commands import Commands
from rapp_link.config import Config, MailConfig
from rapp_link.events import Event
from rapp_link.jobs import JobTable
from rapp_link.office import Office
from rapp_link.outbox import Outbox
from rapp_link.postman import Postman
from rapp_link.reports import Reports
from rapp_link.smtp import SmtpSender

QUICK = {"connect_timeout": 0.3, "transfer_timeout": 1.0, "retry_first": 0.02, "retry_most": 0.1}  # s


def tell(event: Event) -> None:
    print(json.dumps(event.fields()), flush=True)


async def serve(home: Path, port: int) -> None:
    account = {"user": "nao@home.example", "password": "secret", "sender": "nao@home.example"}
    mail = MailConfig(host="127.0.0.1", port=port, security="none", **account, **QUICK)
    config = Config(home, mail=mail)
    reports, outbox = Reports(home / "link" / "reports"), Outbox(home / "link" / "outbox", mail.waiting)
    postman = Postman(outbox, SmtpSender(mail), mail)
    platform = Platform(HopClient(config.cloud), config, reports)
    commands = Commands(config, platform, None, outbox, postman, reports, CloudAgents(platform)).table()
    office = Office(JobTable(config.jobs, config.longest), commands, tell)
    working = asyncio.create_task(postman.run())
    lines = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(lines), sys.stdin)
    print("READY {}", flush=True)
    while line := await lines.readline():
        job, arguments = json.loads(line)
        try:
            office.request("send_mail", job, json.dumps(arguments), 10.0)
        except HopError as error:
            print(json.dumps({"job": job, "kind": 2, "error": error.kind, "message": str(error)}), flush=True)
    working.cancel()
    await office.close()


if __name__ == "__main__":
    asyncio.run(serve(Path(sys.argv[1]), int(sys.argv[2])))
