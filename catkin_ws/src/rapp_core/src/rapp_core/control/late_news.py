"""What the person has to be told although the run it comes from is over: a mail that was kept, and was then refused."""

import logging
from collections.abc import Callable, Sequence

from rapp_core.control.refusals import not_delivered
from rapp_core.errors import CoreError
from rapp_core.ports import Hop, Undelivered

NOTED = 2.0  # s for the link to note that the person knows

_log = logging.getLogger(__name__)


def note_told(hop: Hop, message_id: str, recipients: Sequence[str], *, late: bool) -> None:
    """Tell the link that the person knows of a refusal, later or at once; a link that does not take it is not waited for."""
    try:
        hop.request("mail_told", {"message_id": message_id, "recipients": list(recipients), "late": late}, NOTED)
    except CoreError as error:
        _log.warning("%s", error)


class LateNews:
    """Says each of them once it has a chance to, and tells the link, which keeps them over a restart of either."""

    def __init__(self, hop: Hop, say: Callable[[str], bool]) -> None:
        """`say` gives whether it was said."""
        self._hop = hop
        self._say = say
        self._said: set[Undelivered] = set()  # the link may not have noted it yet
        self._tried: Undelivered | None = None

    @property
    def waits(self) -> bool:
        """Whether there is something to say that was not tried to be said just before: a robot that cannot speak listens on."""
        return self._hop.undelivered not in (None, self._tried)

    def tell(self) -> None:
        """Say what there is; what could not be said stays for the next time."""
        mail = self._tried = self._hop.undelivered
        if mail is None:
            return
        if mail not in self._said:
            if not self._say(not_delivered(mail.recipients)):
                return
            self._said.add(mail)
        note_told(self._hop, mail.message_id, mail.recipients, late=True)
