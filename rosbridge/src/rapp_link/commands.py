"""What the core can ask of the link: one function per service rapp_hop/<name> (DESIGN §3.2)."""

import asyncio
import json
import logging
import re
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import partial
from typing import Any

from rapp_hop import strict_json
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.hz.delivery import Delivery
from rapp_link.agents import CloudAgents
from rapp_link.cloud_side import Identity, Platform
from rapp_link.config import Config
from rapp_link.disk import Disk, replace_whole
from rapp_link.files import read_shared, shared_file, sorted_out
from rapp_link.letter import Letter
from rapp_link.message import Attachment, Mail, build
from rapp_link.office import Command, Ticket
from rapp_link.outbox import Outbox
from rapp_link.postman import Postman
from rapp_link.reports import Reports
from rapp_link.telling import untold
from rapp_link.threads import in_thread

MARGIN = 0.5  # seconds before a job's deadline at which a mail not sent yet is told as kept
_SERVICE = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*", re.ASCII)
_LANGUAGE = re.compile(r"[A-Za-z]{2,3}(-[A-Za-z0-9]{2,8})*", re.ASCII)
_LIST_LIMIT = 2**20  # bytes
_log = logging.getLogger(__name__)


class Commands:
    """The services of the link."""

    def __init__(
        self,
        config: Config,
        platform: Platform,
        delivery: Delivery | None,
        outbox: Outbox,
        postman: Postman,
        reports: Reports,
        agents: CloudAgents,
    ) -> None:
        """Take the parts.

        :param delivery: None when the robot has no trusted root and so can install nothing
        """
        self._config = config
        self._platform = platform
        self._delivery = delivery
        self._outbox = outbox
        self._postman = postman
        self._reports = reports
        self._agents = agents
        self._gone_back: dict[str, Any] = {}  # the last run that did not start, and what came of it
        self._list = config.home / "link" / "rapps.json"

    def table(self) -> Mapping[str, Command]:
        """Return the functions by service name."""
        return {
            "register": self.register,
            "list_rapps": self.list_rapps,
            "interpret": self.interpret,
            "install": self.install,
            "started": self.started,
            "remove": self.remove,
            "start_cloud_agent": self.start_cloud_agent,
            "stop_cloud_agent": self.stop_cloud_agent,
            "call": self.call,
            "send_mail": self.send_mail,
            "mail_told": self.mail_told,
            "report": self.report,
        }

    async def register(self, arguments: dict[str, Any], ticket: Ticket) -> Any:
        """{robot, kind, api_version} → {registered, lease}; from then on the link sends heartbeats."""
        robot, kind, version = take(arguments, robot=str, kind=str, api_version=str)
        return await self._platform.register(Identity(robot, kind, version), ticket.remaining)

    async def list_rapps(self, arguments: dict[str, Any], ticket: Ticket) -> Any:
        """{} → {rapps, revoked}; the last list, with "fresh": false, while the platform is away.

        `revoked`: installed RApps signed by revoked keys only, which are removed, or would be if the disk let them go.
        """
        take(arguments)
        try:
            answer = await self._platform.call("list_rapps", {"robot": self._platform.robot}, ticket.remaining - MARGIN)
        except Unreachable as error:
            known = await in_thread(self._last_list)
            if known is None:
                raise
            _log.warning("%s: the last list is used", error)
            return known | {"fresh": False}
        if not isinstance(answer, dict) or not isinstance(answer.get("rapps"), list):
            raise Invalid("cannot list RApps: the platform's answer is no list")
        answer["revoked"] = await self._drop_revoked(ticket)
        await in_thread(self._keep_list, answer)
        return answer

    async def _drop_revoked(self, ticket: Ticket) -> list[str]:
        if self._delivery is None:
            return []
        with untold():
            look = asyncio.ensure_future(self._delivery.drop_revoked())
        try:
            await asyncio.wait([look], timeout=max(0.0, ticket.remaining - MARGIN))
            if look.done():
                return sorted(look.result())
            _log.warning("cannot see in time which keys were revoked")
        except (HopError, OSError) as error:
            _log.warning("cannot see which keys were revoked: %s", error)
        finally:
            look.cancel()  # not waited for: its thread may wait for an installation
        return []

    async def interpret(self, arguments: dict[str, Any], ticket: Ticket) -> Any:
        """{recording, language} → {rapp | null, confidence, text, candidates, choice}."""
        recording, language = take(arguments, recording=str, language=str)
        if not _LANGUAGE.fullmatch(language):
            raise Refused(f"cannot interpret the language {language[:20]!a}: give one such as en")
        path = await in_thread(shared_file, self._config.home, recording)
        return await self._platform.call("interpret", {"language": language}, ticket.remaining, recording=path)

    async def install(self, arguments: dict[str, Any], ticket: Ticket) -> Any:
        """{name} → {name, version, path, installed}; phases downloading, verified, installed."""
        (name,) = take(arguments, name=str)

        def on_phase(phase: str, details: dict[str, Any]) -> None:
            whole = details.get("of", 0)
            ticket.progress(phase, details.get("bytes", 0) / whole if whole else 1.0)

        done = await self._store().install(name, None, on_phase, self._platform.recipient)
        return {"name": done.name, "version": done.version, "path": str(done.path), "installed": done.new}

    async def started(self, arguments: dict[str, Any], _ticket: Ticket) -> Any:
        """{run, name, version, ok, detail} → {back}: how the first start of a version ended; the version gone back to, or null.

        Going back becomes part of what the core agent reports of the run.
        """
        run, name, version, ok, detail = take(arguments, run=str, name=str, version=str, ok=bool, detail=str)
        before = await self._store().started(name, version, ok)
        if before is None:
            return {"back": None}
        _log.warning("%s %s did not start (%s): %s is back", name, version, detail, before.version)
        self._gone_back = {"run": run, "rolled_back": {"rapp": name, "from": version, "to": before.version, "why": detail[:500]}}
        return {"back": before.version}

    async def remove(self, arguments: dict[str, Any], _ticket: Ticket) -> Any:
        """{name} → {removed}; refused while it runs."""
        (name,) = take(arguments, name=str)
        return {"removed": await self._store().remove(name)}

    async def start_cloud_agent(self, arguments: dict[str, Any], ticket: Ticket) -> Any:
        """{rapp, version, run} → {agent}: the name by which `call` knows it."""
        rapp, version, run = take(arguments, rapp=str, version=str, run=str)
        return {"agent": await self._agents.start(rapp, version, run, ticket.remaining)}

    async def stop_cloud_agent(self, arguments: dict[str, Any], ticket: Ticket) -> Any:
        """{run} → {stopped}; nothing of it runs any more then."""
        (run,) = take(arguments, run=str)
        return {"stopped": await self._agents.stop(run, ticket.remaining)}

    async def call(self, arguments: dict[str, Any], ticket: Ticket) -> Any:
        """{service, arguments, agent} → what the service returns: the platform's, or, with `agent`, that cloud agent's.

        An argument {"file": path} is a file to send.
        """
        service, values, agent = take({"agent": "", **arguments}, service=str, arguments=dict, agent=str)
        if not _SERVICE.fullmatch(service) or (agent and "/" in service):
            raise Refused(f"cannot call {service[:60]!a}: give a service's name")
        if agent:
            service = f"{await self._agents.address(agent, ticket.remaining)}/{service}"
        plain, files = await in_thread(sorted_out, self._config.home, values)
        return await self._platform.call(service, plain, ticket.remaining, **files)

    async def send_mail(self, arguments: dict[str, Any], ticket: Ticket) -> Any:
        """{recipients, subject, body, attachment, message_id} → {state: delivered | kept | locked, message_id}.

        Kept, to be sent later, because the server is away or says "later"; locked: kept too, because the server does not
        let the robot's account in.

        Once the mail is in the outbox it goes out, also when the job is cancelled or its caller has gone.
        """
        if not self._config.mail.host:
            raise Refused("cannot send mail: the robot has no mail account, start the link with --smtp-host")
        letter = await in_thread(self._put, arguments)
        letter = await self._postman.deliver(letter, max(0.0, ticket.remaining - MARGIN))
        return _told(letter)

    async def mail_told(self, arguments: dict[str, Any], _ticket: Ticket) -> Any:
        """{message_id, recipients, late} → {told}: it is known that a mail was refused, else `sign_of_life` goes on naming it.

        Not `late`: who asked for the mail has had its answer, which may as well have been lost on the way.
        """
        message_id, recipients, late = take(arguments, message_id=str, recipients=list, late=bool)
        try:
            await in_thread(partial(self._outbox.told, message_id, recipients, late=late))
        except Refused as error:
            _log.error("%s", error)
        return {"told": True}

    async def report(self, arguments: dict[str, Any], _ticket: Ticket) -> Any:
        """{run} → {kept}; it goes to the platform as soon as that can be reached. False: it has it already."""
        (run,) = take(arguments, run=dict)
        if self._gone_back and run.get("run") == self._gone_back["run"]:
            run = {**run, **self._gone_back}
        kept = await in_thread(self._reports.keep, run)
        self._platform.hurry()
        return {"kept": kept}

    def _store(self) -> Delivery:
        if self._delivery is None:
            raise Refused("cannot install: the robot trusts no store yet, start the link with --root-file")
        return self._delivery

    def _put(self, arguments: dict[str, Any]) -> Letter:
        names = {"recipients": list, "subject": str, "body": str, "attachment": str, "message_id": str}
        recipients, subject, body, path, message_id = take(arguments, **names)
        if not all(isinstance(name, str) for name in recipients):
            raise Invalid("cannot read the recipients: give a list of addresses")
        attachment = Attachment(*read_shared(self._config.home, path, self._config.mail.attachment)) if path else None
        mail = Mail(tuple(recipients), subject, body, message_id, attachment)
        now = datetime.now(UTC)
        return self._outbox.put(build(mail, self._config.mail.sender, now), self._config.mail.sender, now.timestamp())

    def _keep_list(self, answer: dict[str, Any]) -> None:
        try:
            replace_whole(Disk(), self._list, json.dumps(answer).encode())
        except OSError as error:
            _log.warning("cannot keep the list of RApps: %s", error.strerror)

    def _last_list(self) -> dict[str, Any] | None:
        try:
            known = strict_json.loads(self._list.read_bytes(), limit=_LIST_LIMIT)
        except (OSError, Invalid):
            return None
        return known if isinstance(known, dict) else None


def take(arguments: Mapping[str, Any], /, **names: type) -> tuple[Any, ...]:
    """Return the named arguments in order.

    :raises Invalid: one is missing, of another type, or not known
    """
    for name in arguments:
        if name not in names:
            raise Invalid(f"cannot use the argument {name[:60]!a}: give {', '.join(names) or 'none'}")
    for name, kind in names.items():
        if not isinstance(arguments.get(name), kind):
            raise Invalid(f"cannot do without {name} ({kind.__name__}): give it")
    return tuple(arguments[name] for name in names)


def _told(letter: Letter) -> dict[str, str]:
    if letter.refused:
        words = "; ".join(f"{name}: {said}" for name, said in letter.refused.items())
        others = [name for name in letter.recipients if name not in letter.refused]
        rest = f" ({', '.join(others)}: {'kept' if letter.pending else 'delivered'})" if others else ""
        raise Refused(f"cannot deliver to {words}{rest}")
    state = "delivered" if letter.state == "sent" else "locked" if letter.locked else "kept"
    return {"state": state, "message_id": letter.message_id}


async def sign_of_life(publish: Any, platform: Platform, outbox: Outbox, boot: str, every: float) -> None:
    """Publish that the link lives, whether the platform does, and a refused mail nobody was told of, until cancelled.

    :param every: seconds
    """
    while True:
        letter = outbox.untold()
        undelivered = {"message_id": letter.message_id, "recipients": letter.untold} if letter else None
        publish({"boot": boot, "cloud": platform.reachable, "undelivered": undelivered})
        await asyncio.sleep(every)
