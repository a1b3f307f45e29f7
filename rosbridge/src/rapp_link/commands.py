"""What the link does for the core agent: one function per service rapp_hop/<name> (DESIGN section 3.2)."""

import asyncio
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rapp_hop.client import HopClient
from rapp_hop.errors import HopError
from rapp_hop.hz.delivery import Delivery
from rapp_link.config import Config
from rapp_link.errors import Invalid, Refused, Unreachable
from rapp_link.jobs import Command, Progress
from rapp_link.message import build, request
from rapp_link.outbox import Outbox
from rapp_link.reports import Reports

_log = logging.getLogger(__name__)
INTERPRETATION = 25.0  # s
CALL = 120.0  # s; the caller's own time-out is the job's and ends it earlier


class Commands:
    """All commands, and what goes on in the background: heartbeats, kept mails, kept reports."""

    def __init__(self, config: Config, client: HopClient, delivery: Delivery | None, outbox: Outbox, reports: Reports) -> None:
        self._config = config
        self._client = client
        self._delivery = delivery
        self._outbox = outbox
        self._reports = reports
        self._mail_lock = asyncio.Lock()
        self._retry = asyncio.Event()
        self._robot: dict[str, Any] | None = None
        self.cloud_present = False

    def table(self) -> dict[str, Command]:
        """Command of each service."""
        return {
            "register": self.register,
            "list_rapps": self.list_rapps,
            "interpret": self.interpret,
            "install": self.install,
            "remove": self.remove,
            "call": self.call,
            "send_mail": self.send_mail,
            "report": self.report,
        }

    async def register(self, arguments: Mapping[str, Any], _progress: Progress) -> Any:
        """Register with the repository agent; heartbeats follow from then on."""
        self._robot = dict(arguments)
        answer = await self._client.call("register", self._robot)
        self.cloud_present = True
        return {"registered": True, "lease": answer["lease"]}

    async def list_rapps(self, _arguments: Mapping[str, Any], _progress: Progress) -> Any:
        """The catalogue."""
        return await self._client.call("list_rapps", {})

    async def interpret(self, arguments: Mapping[str, Any], _progress: Progress) -> Any:
        """Send a recorded long command for interpretation."""
        recording = Path(str(arguments.get("recording", ""))).resolve()
        if not recording.is_relative_to(self._config.home):
            raise Refused(f"cannot interpret {recording}: only the robot's own recordings leave it")
        language = str(arguments.get("language", "en"))
        return await self._client.call("interpret", {"language": language}, {"recording": recording}, INTERPRETATION)

    async def install(self, arguments: Mapping[str, Any], progress: Progress) -> Any:
        """Download, verify and install a RApp."""

        def phase(name: str, details: Mapping[str, Any]) -> None:
            progress(name, details["bytes"] / details["of"] if details.get("of") else 1.0)

        installed = await self._packages().install(_text(arguments, "name"), on_phase=phase)
        return {
            "name": installed.name,
            "version": str(installed.version),
            "path": str(installed.path),
            "installed": bool(installed.new),
        }

    async def remove(self, arguments: Mapping[str, Any], _progress: Progress) -> Any:
        """Remove an installed RApp."""
        return {"removed": await self._packages().remove(_text(arguments, "name"))}

    async def call(self, arguments: Mapping[str, Any], _progress: Progress) -> Any:
        """Call a HOP service for a dynamic agent."""
        values = arguments.get("arguments", {})
        if not isinstance(values, dict):
            raise Invalid("cannot call: arguments must be an object")
        return await self._client.call(_text(arguments, "service"), values, timeout=CALL)

    async def send_mail(self, arguments: Mapping[str, Any], _progress: Progress) -> Any:
        """Keep the mail on disk, try to send it: "delivered", or "kept" when it goes later."""
        mail = request(arguments, self._config.home)
        content = await asyncio.to_thread(build, mail, self._config.smtp.sender)
        async with self._mail_lock:
            kept = await asyncio.to_thread(self._outbox.put, mail.message_id, mail.recipients, content)
            if kept.state == "refused":
                raise Refused(kept.reason)
            try:
                await asyncio.to_thread(self._outbox.deliver, kept)
            except Unreachable as error:
                _log.warning("%s; the mail is kept", error)
                self._retry.set()
                return {"state": "kept", "message_id": mail.message_id}
        return {"state": "delivered", "message_id": mail.message_id}

    async def report(self, arguments: Mapping[str, Any], _progress: Progress) -> Any:
        """Keep the report of a run on disk; it is sent in the background."""
        run = arguments.get("run")
        if not isinstance(run, dict):
            raise Invalid("cannot report: run must be an object")
        await asyncio.to_thread(self._reports.put, run)
        self._retry.set()
        return {"kept": True}

    async def keep_sending(self) -> None:
        """Send kept mails and reports, with growing pauses while the other side is away. Ends by cancelling."""
        pause = self._config.retry_first
        while True:
            async with self._mail_lock:
                left = await asyncio.to_thread(self._outbox.deliver_all)
            left += await self._reports.send_all(self._client)
            pause = min(2 * pause, self._config.retry_most) if left else self._config.retry_first
            if left:
                await asyncio.sleep(pause)
            else:
                self._retry.clear()
                await self._retry.wait()

    async def keep_registered(self) -> None:
        """Heartbeats to the platform, and a new registration when it has forgotten the robot. Ends by cancelling."""
        while True:
            await asyncio.sleep(self._config.heartbeat_period)
            if self._robot is None:
                continue
            try:
                answer = await self._client.call("heartbeat", {})
                if not answer["registered"]:
                    await self._client.call("register", self._robot)
                self.cloud_present = True
            except HopError as error:
                self.cloud_present = False
                _log.warning("no heartbeat: %s", error)

    def _packages(self) -> Delivery:
        if self._delivery is None:
            raise Refused("cannot install: the link was started without --root-file, so no package can be verified")
        return self._delivery


def _text(arguments: Mapping[str, Any], name: str) -> str:
    value = arguments.get(name)
    if not isinstance(value, str) or not value:
        raise Invalid(f"cannot do that: {name} is missing")
    return value
