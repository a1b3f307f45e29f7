"""Calls of a dynamic agent that leave the robot: to the repository agent and to the mail server, by way of the link."""

import itertools
import json
import logging
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_core.config import Config
from rapp_core.control.cloud_agent import CloudAgents
from rapp_core.control.late_news import note_told
from rapp_core.errors import NOT_KNOWN, Invalid, Refused, Unreachable
from rapp_core.ports import Agent, Hop
from rapp_core.services.sendable import CallFile, Sendable

MAIL_AGAIN = 0.5  # s between tries to hand a mail to a link that is away

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class CloudCall:
    """A dynamic agent's call of a HOP service."""

    service: str
    arguments: str  # JSON object; {"file": path} stands for a file
    timeout: float = 0.0  # s; 0: our own
    agent: bool = False  # of its own cloud agent, instead of the repository agent
    files: Sequence[CallFile] = ()  # further parameters, handed over with the call


class Outside:
    """rapp_cloud_call, rapp_stop_cloud_agent, rapp_send_mail; a RApp may use what its package.json names, and its cloud agent."""

    def __init__(
        self,
        hop: Hop,
        cloud_agents: CloudAgents,
        config: Config,
        stop: threading.Event,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """No new try after `stop` is set."""
        self._hop = hop
        self._cloud_agents = cloud_agents
        self._config = config
        self._stop = stop
        self._now = now
        self._numbers = itertools.count(1)

    def cloud_call(self, run: Agent, call: CloudCall) -> str:
        """Call a HOP service; gives its JSON result. Raises Refused, Unreachable, Invalid, Bug."""
        until = self._now() + (call.timeout if call.timeout > 0 else self._config.cloud_call_timeout)
        request: dict[str, Any] = {"service": call.service}
        if call.agent:
            request["agent"] = self._cloud_agents.name_for(run, max(0.0, until - self._now()))
        else:
            self._allowed(run, call.service)
        arguments = _arguments(call.service, call.arguments)
        sendable = Sendable(run, self._config)
        sendable.check(arguments)
        with sendable.written(call.files) as files:
            return json.dumps(self._hop.request("call", request | {"arguments": arguments | files}, max(0.1, until - self._now())))

    def stop_cloud_agent(self, run: Agent) -> bool:
        """Have the run's cloud agent stopped (deliverable section 3.2); gives whether there was one. Raises CoreError."""
        return self._cloud_agents.stop(run, self._config.cloud_agent_stop)

    def send_mail(self, run: Agent, recipients: Sequence[str], subject: str, body: str, attachment: str) -> str:
        """Have a mail sent (paper Fig. 12); see `rapp_api.cloud.send_mail_wait`. Raises Refused, Unreachable, Invalid, Bug."""
        self._allowed(run, "send_mail")
        if attachment and not Path(attachment).resolve().is_relative_to(run.recordings.resolve()):
            raise Refused(f"cannot attach {attachment}: only recordings of this run may leave the robot")
        mail: dict[str, Any] = {
            "recipients": list(recipients),
            "subject": subject,
            "body": body,
            "attachment": attachment,
            "message_id": f"<{run.name}.{next(self._numbers)}@{self._config.name}.rapp>",
        }
        return self._hand_over(run, mail)

    def _hand_over(self, run: Agent, mail: dict[str, Any]) -> str:
        """A link that goes away meanwhile is given the mail again: it knows by the Message-ID what it has already.

        One that does not come back may have kept it, and may still send it.
        """
        begun, whole, may_have_it = self._now(), self._config.mail_timeout, False
        while True:
            left = begun + whole - self._now()
            try:
                return str(self._hop.request("send_mail", mail, left)["state"])
            except Refused:
                if run.alive:  # otherwise the person is told later, by `control.late_news`
                    note_told(self._hop, mail["message_id"], mail["recipients"], late=False)
                raise
            except Unreachable as error:
                may_have_it = may_have_it or error.reason == NOT_KNOWN
                late = self._now() + MAIL_AGAIN >= begun + min(self._config.link_back, whole)
                if late or not run.alive or self._stop.wait(MAIL_AGAIN):
                    if may_have_it:
                        _log.warning("%s", error)
                        return "unknown"
                    raise

    @staticmethod
    def _allowed(run: Agent, service: str) -> None:
        if run.manifest is None or service not in run.manifest.cloud:
            raise Refused(f"cannot call {service}: the RApp's package.json does not name it under permissions.cloud")


def _arguments(service: str, text: str) -> dict[str, Any]:
    try:
        values = json.loads(text or "{}")
    except ValueError as error:
        raise Invalid(f"cannot call {service}: its arguments are no JSON ({error})") from error
    if not isinstance(values, dict):
        raise Invalid(f"cannot call {service}: its arguments must be a JSON object")
    return values
