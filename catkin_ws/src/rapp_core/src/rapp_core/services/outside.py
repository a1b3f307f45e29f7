"""Calls of a dynamic agent that leave the robot: to the repository agent and to the mail server, by way of the link."""

import itertools
import json
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rapp_core.config import Config
from rapp_core.errors import Invalid, Refused, Unreachable
from rapp_core.ports import Agent, Hop

MAIL_AGAIN = 0.5  # s between tries to hand a mail to a link that is away


class Outside:
    """rapp_cloud_call and rapp_send_mail; a RApp may use only what its package.json names."""

    def __init__(self, hop: Hop, config: Config, stop: threading.Event, now: Callable[[], float] = time.monotonic) -> None:
        """No new try after `stop` is set."""
        self._hop = hop
        self._config = config
        self._stop = stop
        self._now = now
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
        result = self._hop.request("call", {"service": service, "arguments": values}, limit)
        return json.dumps(result)

    def send_mail(self, run: Agent, recipients: Sequence[str], subject: str, body: str, attachment: str) -> str:
        """Have a mail sent (paper Fig. 12); gives "delivered", "kept" or "locked". Raises Refused, Unreachable, Invalid, Bug."""
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
        """A link that goes away meanwhile is given the mail again: it knows by the Message-ID what it has already."""
        begun, whole = self._now(), self._config.mail_timeout
        while True:
            left = begun + whole - self._now()
            try:
                return str(self._hop.request("send_mail", mail, left)["state"])
            except Unreachable:
                late = self._now() + MAIL_AGAIN >= begun + min(self._config.link_back, whole)
                if late or not run.alive or self._stop.wait(MAIL_AGAIN):
                    raise

    @staticmethod
    def _allowed(run: Agent, service: str) -> None:
        if run.manifest is None or service not in run.manifest.cloud:
            raise Refused(f"cannot call {service}: the RApp's package.json does not name it under permissions.cloud")
