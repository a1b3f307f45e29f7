"""What the link tells of its messages to and from the platform and the mail server, so that runs can be drawn.

Each form is that of rapp_msgs/AgentState. A call without a reply is told as a note: no message came.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from rapp_hop.client import HopClient
from rapp_hop.errors import HopError
from rapp_hop.streaming import Progress, Writer
from rapp_link.letter import Outcome
from rapp_link.smtp import Sender

REPOSITORY, MAIL_SERVER, CLOUD_AGENT = "repository", "mail-server", "cloud-agent"
UNTOLD = frozenset({"heartbeat", "list_rapps", "list_cloud_agents", "report"})
"""Asked again and again, whether something happens or not; and what is said of runs that are over."""
_AGENT = re.compile(r"agents/[^/]+/(.+)")  # address of a cloud agent's service, which is nobody's business
_HASH = re.compile(r"^[0-9a-f]{64}\.")  # before the name of a file of the store

Tell = Callable[[str], None]
_quiet: ContextVar[bool] = ContextVar("quiet", default=False)


@contextmanager
def untold() -> Iterator[None]:
    """Tell nothing of what is fetched within, threads and tasks of it included: a look that comes again and again."""
    token = _quiet.set(True)
    try:
        yield
    finally:
        _quiet.reset(token)


class TellingClient(HopClient):
    """Tells what is asked of the platform and what it answers."""

    def __init__(self, base_url: str, token: str | None, tell: Tell, ca_file: Path | None = None) -> None:
        """See `HopClient`.

        :param tell: called in the loop
        """
        super().__init__(base_url, token, ca_file=ca_file)
        self._tell = tell

    async def call(
        self,
        service: str,
        args: Mapping[str, Any] | None = None,
        files: Mapping[str, Path] | None = None,
        timeout: float = 30.0,
    ) -> Any:
        """See `HopClient`."""
        if service in UNTOLD:
            return await super().call(service, args, files, timeout)
        agent = _AGENT.fullmatch(service)
        whom, what = (CLOUD_AGENT, agent[1]) if agent else (REPOSITORY, service)
        return await self._told(whom, what, super().call(service, args, files, timeout))

    async def download(
        self,
        path: str,
        destination: Path | Writer,
        limit: int,
        timeout: float = 60.0,
        on_progress: Progress | None = None,
        start: int = 0,
    ) -> int:
        """See `HopClient`."""
        name = _HASH.sub("", urlsplit(path).path.rpartition("/")[2])
        work = super().download(path, destination, limit, timeout, on_progress, start)
        if _quiet.get():
            return await work
        count: int = await self._told(REPOSITORY, f"GET {name}{f' from byte {start}' if start else ''}", work)
        return count

    async def _told(self, whom: str, what: str, work: Any) -> Any:
        self._tell(f"link->{whom} {what}")
        try:
            result = await work
        except HopError as error:
            answered = error.status is not None
            self._tell(f"{whom}->link reply {what}: {error.status}" if answered else f"link: no answer to {what}")
            raise
        self._tell(f"{whom}->link reply {what}")
        return result


class TellingSender:
    """Tells what is asked of the mail server and what it answers (paper Fig. 12)."""

    def __init__(self, sender: Sender, tell: Tell) -> None:
        """Tell what `sender` does.

        :param tell: called in the loop
        """
        self._sender = sender
        self._tell = tell

    async def send(self, sender: str, recipients: Sequence[str], content: bytes) -> Outcome:
        """See `Sender`."""
        self._tell(f"link->{MAIL_SERVER} mail (SMTP)")
        try:
            outcome = await self._sender.send(sender, recipients, content)
        except HopError as error:
            self._tell(f"link: the mail is not taken ({error.kind})")
            raise
        self._tell(f"{MAIL_SERVER}->link reply mail (SMTP): {_words(outcome)}")
        return outcome


def _words(outcome: Outcome) -> str:
    parts = {"taken": outcome.accepted, "refused": outcome.refused, "later": outcome.later}
    return ", ".join(word for word, names in parts.items() if names)
