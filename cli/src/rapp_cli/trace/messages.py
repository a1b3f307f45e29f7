"""From the record of a robot's agents to what a sequence diagram shows (pure)."""

import heapq
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Literal

from rapp_cli.errors import CommandError
from rapp_cli.timeline import KINDS, Entry

LONGEST = 200  # characters of one text
SHOWN = 3  # times that the same question is shown within one state; who asks more often polls
_ARROW = re.compile(r"(?P<source>[\w-]+)->(?P<target>[\w-]+) (?P<reply>reply )?(?P<text>.+?)(?P<send> \(asynchronous\))?")
_NOTE = re.compile(r"(?P<source>[\w-]+): (?P<text>.+)")
_TALK = ("said", "heard")


@dataclass(frozen=True)
class Item:
    """A message from `source` to `target`, or a note or state of `source` alone; `times` in a row."""

    kind: Literal["call", "send", "reply", "note", "state"]
    source: str
    target: str
    text: str
    time: float  # s since 1970
    times: int = 1

    @property
    def label(self) -> str:
        """The text for people."""
        return f"{self.text} ({self.times} times)" if self.times > 1 else self.text


def entries(lines: Sequence[str], name: str) -> list[Entry]:
    """Read a record. Raises CommandError for one that is broken; its last line may be unfinished."""
    found = []
    for number, line in enumerate(lines, 1):
        try:
            entry = Entry(**json.loads(line))
            if entry.kind not in KINDS or not all(isinstance(e, str) for e in (entry.agent, entry.state, entry.detail)):
                raise ValueError("no entry of a timeline")
            found.append(replace(entry, time=float(entry.time)))
        except (ValueError, TypeError) as error:
            if number < len(lines):
                raise CommandError(f"cannot read {name}: line {number} is broken ({error}); give another folder") from error
    return in_order(found)


def in_order(found: Iterable[Entry]) -> list[Entry]:
    """What the person says is written down by another process: put it where it belongs. The agents' order is that of causes."""
    mine = {person: [e for e in found if (e.agent == "person") is person] for person in (True, False)}
    return list(heapq.merge(mine[False], mine[True], key=lambda entry: entry.time))


def last_run(record: Sequence[Entry]) -> list[Item]:
    """From the last command, for which the robot stopped listening, until it listens again, or until now.

    Raises CommandError when there was none.
    """
    left = next((i for i in reversed(range(len(record))) if _core(record[i], "left", "s3")), None)
    if left is None:
        raise CommandError("cannot draw: the robot has not been asked for anything yet; say something to it first")
    ends = (i for i in range(left, len(record)) if _core(record[i], "entered", "s3") or _core(record[i], "entered", "s1"))
    run = [*_command(record[:left]), *record[left : next(ends, len(record)) + 1]]
    spoken = any(entry.agent == "person" for entry in run)
    items = [item(entry, spoken=spoken) for entry in run]
    return squeezed(folded([each for each in items if each is not None]))


def _command(before: Sequence[Entry]) -> list[Entry]:
    """What was said and heard last while the robot listened; what else went on then is not of this run."""
    begin = next((i for i in reversed(range(len(before))) if _core(before[i], "entered", "s3")), 0)
    talk = [entry for entry in before[begin:] if entry.kind in _TALK]
    said = [i for i, entry in enumerate(talk) if entry.agent == "person"]
    return talk[said[-1] :] if said else talk[-1:]


def _core(entry: Entry, kind: str, state: str) -> bool:
    return (entry.agent, entry.kind, entry.state) == ("core", kind, state)


def item(entry: Entry, *, spoken: bool = True) -> Item | None:
    """What an entry is in a diagram, if anything; `spoken` when the record tells what the person says, not only what is heard."""
    text = _clean(entry.detail)
    if entry.kind == "said":
        other = "core" if entry.agent == "person" else "person"
        return Item("send", entry.agent, other, f"“{text}”", entry.time)
    if entry.kind == "heard":
        if spoken:
            return Item("note", "core", "core", f"heard “{text}”", entry.time)
        return Item("send", "person", "core", f"“{text}”", entry.time)
    if entry.kind == "message":
        return _message(text, entry)
    if "/" in entry.state or entry.kind == "left":
        return None  # steps of a core service: its messages show them
    if entry.kind == "failed":
        return Item("note", entry.agent, entry.agent, f"{entry.state} failed: {text}", entry.time)
    return Item("state", entry.agent, entry.agent, f"{entry.state} {text}".strip(), entry.time)


def _message(text: str, entry: Entry) -> Item:
    """The one place that reads the form of messages, see rapp_msgs/AgentState."""
    if found := _ARROW.fullmatch(text):
        kind: Literal["reply", "send", "call"] = "reply" if found["reply"] else "send" if found["send"] else "call"
        return Item(kind, found["source"], found["target"], found["text"], entry.time)
    if found := _NOTE.fullmatch(text):
        return Item("note", found["source"], found["source"], found["text"], entry.time)
    return Item("note", entry.agent, entry.agent, text, entry.time)


def _clean(text: str) -> str:
    words = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return words if len(words) <= LONGEST else words[: LONGEST - 1] + "…"


def squeezed(items: Iterable[Item]) -> list[Item]:
    """The same message several times in a row becomes one."""
    kept: list[Item] = []
    for each in items:
        if kept and replace(each, time=0, times=1) == replace(kept[-1], time=0, times=1):
            kept[-1] = replace(kept[-1], times=kept[-1].times + 1)
        else:
            kept.append(each)
    return kept


def folded(items: Sequence[Item]) -> list[Item]:
    """Polling becomes one question and its answer, where it begins, with how many times.

    That is the same call with the same reply, more than `SHOWN` times between two changes of state, for which nobody else is asked:
    mostly nothing is told between call and reply.
    """
    state = list(accumulate(each.kind == "state" for each in items))
    groups: dict[tuple[int, Item, Item], list[tuple[int, int]]] = {}
    for call, reply in pairs(items):
        key = (state[call], replace(items[call], time=0), replace(items[reply], time=0))
        groups.setdefault(key, []).append((call, reply))
    kept: list[Item | None] = list(items)
    for found in groups.values():
        if len(found) > SHOWN and 2 * sum(reply == call + 1 for call, reply in found) > len(found):
            for call, reply in found[1:]:
                kept[call] = kept[reply] = None
            for index in found[0]:
                kept[index] = replace(items[index], times=len(found))
    return [each for each in kept if each is not None]


def pairs(items: Sequence[Item]) -> list[tuple[int, int]]:
    """Index of each call that was replied to, and index of its reply."""
    waiting: list[int] = []
    found = []
    for index, each in enumerate(items):
        if each.kind == "call":
            waiting.append(index)
        elif each.kind == "reply":
            call = next((i for i in reversed(waiting) if answers(each, items[i])), None)
            if call is not None:
                waiting.remove(call)
                found.append((call, index))
    return sorted(found)


def answers(reply: Item, call: Item) -> bool:
    """Whether a reply may be that of a call: it repeats the call's text, and may say more after a colon."""
    same = reply.text == call.text or reply.text.startswith(f"{call.text}:")
    return same and (reply.source, reply.target) == (call.target, call.source)
