"""The side towards the platform: who this robot is, its heartbeats, and the reports that wait for the way to be free."""

import asyncio
import json
import logging
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.hz.delivery import Recipient
from rapp_link.config import Config
from rapp_link.disk import Disk, replace_whole
from rapp_link.reports import Reports
from rapp_link.threads import in_thread

_log = logging.getLogger(__name__)
PATIENCE = 10.0  # seconds for a heartbeat, a registration or a report
SHORTEST = 0.5  # seconds between heartbeats
_OF_THE_REPORT = {400, 413}  # HTTP statuses by which the platform says that the report itself is wrong


@dataclass(frozen=True)
class Identity:
    """What the robot registers as; the first time the core says it, afterwards the disk knows."""

    robot: str
    kind: str
    api_version: str


class Platform:
    """The robot's standing with the platform. `run` keeps it; `reachable` tells how it is."""

    def __init__(self, client: HopClient, config: Config, reports: Reports, disk: Disk | None = None) -> None:
        """Prepare, with the identity that an earlier process wrote down."""
        self._client = client
        self._config = config
        self._reports = reports
        self._disk = disk or Disk()
        self._file = config.home / "link" / "robot.json"
        self._identity = _recall(self._file)
        self._registered = False
        self._lease = 3 * config.heartbeat_most  # seconds; the platform says it
        self._wake = asyncio.Event()
        self._complaint = ""  # what the log says of the platform already
        self._odd: Counter[Path] = Counter()  # how often a report was answered oddly
        self.reachable = False

    @property
    def robot(self) -> str:
        """Name of this robot.

        :raises Refused: nobody has said it yet
        """
        if self._identity is None:
            raise Refused("cannot ask the platform before the robot is registered: call register first")
        return self._identity.robot

    @property
    def recipient(self) -> Recipient | None:
        """What packages must fit, as far as the core has said it."""
        found = self._identity
        return Recipient(found.robot, found.kind, found.api_version) if found else None

    async def register(self, identity: Identity, patience: float) -> dict[str, Any]:
        """Register now, and keep trying in the background when the platform is away.

        :param patience: seconds
        :raises HopError: what the platform says
        """
        self._identity = identity
        await in_thread(self._write_down, identity)
        try:
            return await self._register(identity, patience)
        finally:
            self._wake.set()  # from now on the background keeps it registered

    async def call(self, service: str, arguments: dict[str, Any], timeout: float, **files: Path) -> Any:
        """Call a service of the platform, registering again when it has been started anew; see `HopClient.call`."""
        try:
            return await self._client.call(service, arguments, files, timeout)
        except Refused:
            if self._identity is None or not self._registered or await self._heartbeat():
                raise
            await self._register(self._identity, timeout)
        return await self._client.call(service, arguments, files, timeout)

    def hurry(self) -> None:
        """Do what is to do now, such as sending a new report."""
        self._wake.set()

    async def run(self) -> None:
        """Keep the robot registered and send reports, until cancelled."""
        pause = self._config.retry_first
        while True:
            self._wake.clear()
            wait = None
            if self._identity is not None:
                if await self._keep_in_touch(self._identity):
                    pause = self._config.retry_first
                    wait = max(SHORTEST, min(self._lease / 3, self._config.heartbeat_most))
                else:
                    wait, pause = pause, min(2 * pause, self._config.retry_most)
            try:
                async with asyncio.timeout(wait):
                    await self._wake.wait()
            except TimeoutError:
                continue

    async def _keep_in_touch(self, identity: Identity) -> bool:
        try:
            if self._registered and not await self._heartbeat():
                _log.warning("the platform has lost this robot: registering again")
                self._registered = False
            if not self._registered:
                await self._register(identity, PATIENCE)
            await self._send_reports(identity)
        except HopError as error:
            if self.reachable or isinstance(error, Refused) or str(error) != self._complaint:
                _log.warning("%s", error)
            self.reachable, self._complaint = False, str(error)
            return False
        self._complaint = ""
        return True

    async def _heartbeat(self) -> bool:
        try:
            answer = await self._client.call("heartbeat", {"robot": self.robot}, timeout=PATIENCE)
        except Refused as error:
            if error.status in (401, 403):
                raise
            return False
        self.reachable = True
        return not isinstance(answer, dict) or bool(answer.get("registered", True))

    async def _register(self, identity: Identity, patience: float) -> dict[str, Any]:
        try:
            answer = await self._client.call("register", asdict(identity), timeout=patience)
        except Unreachable:
            self.reachable = False
            raise
        if not isinstance(answer, dict) or not isinstance(answer.get("lease", 0.0), int | float):
            raise Invalid("cannot register: the platform's answer is none, check its address")
        self._lease = float(answer.get("lease") or self._lease)
        self._registered = self.reachable = True
        return answer

    async def _send_reports(self, identity: Identity) -> None:
        """Send what waits. An odd answer ends the round, and its report goes behind the others: it must not block them."""
        for path in sorted(await in_thread(self._reports.waiting), key=self._odd.__getitem__):
            try:
                await self._send_report(identity, path)
            except HopError as error:
                if isinstance(error, Unreachable) or error.status == 401:
                    raise  # the next one would fare no better
                if not self._odd[path]:
                    _log.warning("report %s waits: %s", path.name, error)
                self._odd[path] += 1
                return
            del self._odd[path]

    async def _send_report(self, identity: Identity, path: Path) -> None:
        """Send one report; what nobody can read, and what the platform finds wrong, is dropped: it would be so for ever."""
        try:
            run = await in_thread(self._reports.read, path)
        except Invalid as error:
            _log.error("report %s is dropped: %s", path.name, error)
        else:
            try:
                await self._client.call("report", {"robot": identity.robot, "run": run}, timeout=PATIENCE)
            except HopError as error:
                if error.status not in _OF_THE_REPORT:
                    raise
                _log.error("report %s is dropped: %s", path.name, error)
        await in_thread(self._reports.done, path)

    def _write_down(self, identity: Identity) -> None:
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            replace_whole(self._disk, self._file, json.dumps(asdict(identity)).encode())
        except OSError as error:
            raise Refused(f"cannot write {self._file}: {error.strerror}, check the folder") from None


def _recall(path: Path) -> Identity | None:
    try:
        fields = json.loads(path.read_text())
        return Identity(str(fields["robot"]), str(fields["kind"]), str(fields["api_version"]))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        _log.warning("cannot use %s: %s, waiting for the core to register", path, error)
        return None
