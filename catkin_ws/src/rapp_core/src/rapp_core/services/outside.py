"""Calls of a dynamic agent that leave the robot: to the repository agent and to the mail server, by way of the link."""

import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rapp_core.config import Config
from rapp_core.errors import Invalid, Refused
from rapp_core.ports import Agent, Hop
from rapp_core.trace import Trace


class Outside:
    """rapp_cloud_call and rapp_send_mail; a RApp may use only what its package.json names."""

    def __init__(self, hop: Hop, config: Config, trace: Trace) -> None:
        self._hop = hop
        self._config = config
        self._trace = trace
        self._numbers = itertools.count(1)

    def cloud_call(self, run: Agent, service: str, arguments: str, timeout: float) -> str:
        """Call a HOP service; gives its JSON result. Raises Refused, Unreachable, Invalid, Bug."""
        self._allowed(run, service)
        try:
            values = json.loads(arguments or "{}")
        except ValueError as error:
            raise Invalid(f"cannot call {service}: its arguments are no JSON ({error})") from error
        if not isinstance(values, dict):
            raise Invalid(f"cannot call {service}: its arguments must be a JSON object")
        limit = timeout if timeout > 0 else self._config.cloud_call_timeout
        self._trace.message(f"dynamic->repository {service}")
        result = self._hop.request("call", {"service": service, "arguments": values}, limit)
        self._trace.message(f"repository->dynamic reply {service}")
        return json.dumps(result)

    def send_mail(self, run: Agent, recipients: Sequence[str], subject: str, body: str, attachment: str) -> str:
        """Have a mail sent (paper Fig. 12); gives "delivered" or "kept". Raises Refused, Unreachable, Invalid, Bug."""
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
        self._trace.message("dynamic->mail server request (SMTP)")
        state = str(self._hop.request("send_mail", mail, self._config.mail_timeout)["state"])
        self._trace.message(f"mail server->dynamic reply {state}")
        return state

    @staticmethod
    def _allowed(run: Agent, service: str) -> None:
        if run.manifest is None or service not in run.manifest.cloud:
            raise Refused(f"cannot call {service}: the RApp's package.json does not name it under permissions.cloud")
