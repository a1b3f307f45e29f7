"""Calls that leave the robot: HOP services of repository and cloud agent, and mail (deliverable sections 3, 4.2, paper Fig. 12).

Three agents: `call` reaches the repository agent's services that package.json names. Four agents: `call_agent` reaches those of the
RApp's own cloud agent, which calls the repository agent's. A `pathlib.Path` among the arguments is sent as a file.

Each comes in two forms: the plain one returns at once, and calls back later from a thread of its own; `..._wait` waits.
"""

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Any

from rapp_api.core_agent import current
from rapp_api.errors import RappError, Refused

OnResult = Callable[[Any], None]
OnError = Callable[[RappError], None]

SERVER_REFUSES = "cannot deliver to "
MOST_OPEN = 8  # asynchronous calls at a time
_open = threading.BoundedSemaphore(MOST_OPEN)
_log = logging.getLogger(__name__)


def call_wait(service: str, args: dict[str, Any] | None = None, timeout: float = 0.0) -> Any:
    """Call a HOP service and wait for its JSON result, at most `timeout` s (0: the core agent's own). Raises RappError."""
    return current().cloud_call(service, args or {}, timeout, False)


def call(
    service: str,
    args: dict[str, Any] | None = None,
    on_result: OnResult | None = None,
    on_error: OnError | None = None,
    timeout: float = 0.0,
) -> None:
    """Call a HOP service asynchronously; one of the callbacks is called, once. Raises Refused when too many calls are open."""
    _later(f"call {service}", lambda: call_wait(service, args, timeout), on_result, on_error)


def call_agent_wait(service: str, args: dict[str, Any] | None = None, timeout: float = 0.0) -> Any:
    """As `call_wait`, of this RApp's cloud agent. Raises Refused too when that has ended, Unreachable when it dies meanwhile."""
    return current().cloud_call(service, args or {}, timeout, True)


def call_agent(
    service: str,
    args: dict[str, Any] | None = None,
    on_result: OnResult | None = None,
    on_error: OnError | None = None,
    timeout: float = 0.0,
) -> None:
    """As `call`, of this RApp's cloud agent."""
    _later(f"call {service}", lambda: call_agent_wait(service, args, timeout), on_result, on_error)


def stop_agent_wait() -> bool:
    """Kill this RApp's cloud agent (deliverable section 3.2); whether there was one. Raises RappError.

    Called by itself when the RApp is dismantled; a RApp that needs it no more may do it before.
    """
    return current().stop_cloud_agent()


def send_mail_wait(recipients: Sequence[str], subject: str, body: str, attachment: str = "") -> str:
    """Send a mail and wait; gives "delivered", or "kept" or "locked" when it will be sent later, or "unknown". Raises RappError.

    "kept": the mail server is away or busy; "locked": it does not let the robot's account in, until somebody mends that.
    "unknown": the robot's way out was lost on the way; it may be sent, or may have been.
    Refused: the server does not take this mail, such as for an address it does not know; the text then begins with SERVER_REFUSES.
    Any other refusal is the robot's own: it keeps too many mails, its disk is full, it has no mail account.
    `attachment` is the path of one of this run's recordings.
    """
    return current().send_mail(list(recipients), subject, body, attachment)


def send_mail(
    recipients: Sequence[str],
    subject: str,
    body: str,
    attachment: str = "",
    on_result: OnResult | None = None,
    on_error: OnError | None = None,
) -> None:
    """Send a mail asynchronously; one of the callbacks is called, once. Raises Refused when too many calls are open."""
    _later("send a mail", lambda: send_mail_wait(recipients, subject, body, attachment), on_result, on_error)


def _later(what: str, work: Callable[[], Any], on_result: OnResult | None, on_error: OnError | None) -> None:
    """An error nobody asked to be told goes to the log."""
    if not _open.acquire(blocking=False):
        raise Refused(f"cannot {what}: {MOST_OPEN} calls are open already; wait for one to end")

    def run() -> None:
        try:
            result = work()
        except RappError as error:
            _open.release()
            (on_error or (lambda unasked: _log.error("%s", unasked)))(error)
        else:
            _open.release()
            if on_result is not None:
                on_result(result)

    threading.Thread(target=run, name=what, daemon=True).start()
