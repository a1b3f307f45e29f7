"""Calls that leave the robot: HOP services of the repository agent, and mail (deliverable section 4.2, paper Fig. 12)."""

import threading
from collections.abc import Callable, Sequence
from typing import Any

from rapp_api.core_agent import current
from rapp_api.errors import RappError

OnResult = Callable[[Any], None]
OnError = Callable[[RappError], None]


def call_wait(service: str, args: dict[str, Any] | None = None, timeout: float = 0.0) -> Any:
    """Call a HOP service and wait for its JSON result, at most `timeout` s (0: the core agent's own). Raises RappError."""
    return current().cloud_call(service, args or {}, timeout)


def call(service: str, args: dict[str, Any] | None, on_result: OnResult, on_error: OnError, timeout: float = 0.0) -> None:
    """Call a HOP service asynchronously: just one of the callbacks is called, from a thread of its own."""
    _later(lambda: call_wait(service, args, timeout), on_result, on_error)


def send_mail_wait(recipients: Sequence[str], subject: str, body: str, attachment: str = "") -> str:
    """Send a mail and wait: "delivered", or "kept" when it will be sent later. Raises RappError when it cannot be sent."""
    return current().send_mail(list(recipients), subject, body, attachment)


def send_mail(
    recipients: Sequence[str], subject: str, body: str, attachment: str, on_result: OnResult, on_error: OnError
) -> None:
    """Send a mail asynchronously: just one of the callbacks is called, from a thread of its own."""
    _later(lambda: send_mail_wait(recipients, subject, body, attachment), on_result, on_error)


def _later(work: Callable[[], Any], on_result: OnResult, on_error: OnError) -> None:
    def run() -> None:
        try:
            result = work()
        except RappError as error:
            on_error(error)
        else:
            on_result(result)

    threading.Thread(target=run, name="cloud call", daemon=True).start()
