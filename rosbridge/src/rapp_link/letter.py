"""One mail's way: queued, then sent or refused. Pure; the outbox keeps it on the disk.

queued --all accepted--> sent
queued --some accepted, the others refused for good--> sent (with `refused` naming them)
queued --all refused for good--> refused
queued --any "later", or no answer--> queued, for those recipients only
queued --the robot's account not let in--> queued, and locked until a try gets further
queued --too old--> refused
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from rapp_hop.errors import Invalid

State = Literal["queued", "sent", "refused"]


@dataclass(frozen=True)
class Outcome:
    """What a mail server said at one try, by recipient."""

    accepted: tuple[str, ...] = ()
    refused: Mapping[str, str] = field(default_factory=dict)  # for good, with the server's words
    later: Mapping[str, str] = field(default_factory=dict)  # not now, with the server's words
    locked: bool = False  # the server does not let the robot's account in; somebody has to mend that


@dataclass(frozen=True)
class Letter:
    """A mail in the outbox."""

    message_id: str
    sender: str
    recipients: tuple[str, ...]
    digest: str  # of the content asked for
    queued_at: float  # seconds since 1970
    pending: tuple[str, ...]  # recipients the server has neither taken nor refused
    refused: Mapping[str, str] = field(default_factory=dict)  # recipient: server's words
    tries: int = 0
    locked: bool = False  # at the last try, see `Outcome`
    told: tuple[str, ...] = ()  # refused recipients of whom the answer to who asked for the mail has told
    late: tuple[str, ...] = ()  # refused recipients of whom was told later, aloud

    @property
    def state(self) -> State:
        """Return how far the mail has come."""
        if self.pending:
            return "queued"
        return "refused" if set(self.refused) >= set(self.recipients) else "sent"

    @property
    def undelivered(self) -> tuple[str, ...]:
        """Return the recipients refused after the mail had been kept: its content stays."""
        return tuple(name for name in self.refused if name not in self.told)

    @property
    def untold(self) -> tuple[str, ...]:
        """Return those of them of whom nobody has been told yet."""
        return tuple(name for name in self.undelivered if name not in self.late)

    def after(self, outcome: Outcome) -> "Letter":
        """Return the letter after a try; a recipient the outcome does not name stays pending."""
        answered = {*outcome.accepted, *outcome.refused}
        refused = {name: words for name, words in outcome.refused.items() if name in self.pending}
        pending = tuple(name for name in self.pending if name not in answered)
        everywhere = {**self.refused, **refused}
        return replace(self, pending=pending, refused=everywhere, tries=self.tries + 1, locked=outcome.locked)


def to_json(letter: Letter) -> bytes:
    """Write a letter down."""
    return json.dumps(asdict(letter), ensure_ascii=False).encode()


def from_json(data: bytes) -> Letter:
    """Read a letter.

    :raises Invalid: when it is not one
    """
    try:
        fields: dict[str, Any] = json.loads(data)
        refused = {str(name): str(words) for name, words in fields["refused"].items()}
        return Letter(
            message_id=str(fields["message_id"]),
            sender=str(fields["sender"]),
            recipients=tuple(map(str, fields["recipients"])),
            digest=str(fields["digest"]),
            queued_at=float(fields["queued_at"]),
            pending=tuple(map(str, fields["pending"])),
            refused=refused,
            tries=int(fields["tries"]),
            locked=bool(fields.get("locked", False)),
            told=tuple(map(str, fields.get("told", refused))),  # one written before this was noted has no content any more
            late=tuple(map(str, fields.get("late", ()))),
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise Invalid(f"cannot read a letter of the outbox: {error}") from None
