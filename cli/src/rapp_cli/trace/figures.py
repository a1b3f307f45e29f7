"""Those parts of a run that are figures of the paper."""

from collections.abc import Sequence
from dataclasses import dataclass

from rapp_cli.errors import CommandError
from rapp_cli.trace.messages import Item, answers, squeezed

AGENT, CORE = "dynamic", "core"


@dataclass(frozen=True)
class Figure:
    """One figure: the call of the dynamic agent that it is about, and whose messages it shows beside those of that call."""

    title: str
    services: tuple[str, ...]
    of_agent: bool  # seen from the dynamic agent, which is suspended until the reply
    shown: tuple[str, ...] = ()


_RECORD = ("rapp_record", "rapp_record_until_silence")
FIGURES = {
    5: Figure("the core agent's service “say”", ("rapp_say",), False, ("ALTextToSpeech",)),
    6: Figure("the core agent's service “recognise word”", ("rapp_recognize",), False, ("ALSpeechRecognition", "ALMemory")),
    7: Figure("the core agent's service “voice record”", _RECORD, False, ("ALAudioRecorder",)),
    9: Figure("the dynamic agent's behaviour “record message”", _RECORD, True),
    10: Figure("the dynamic agent's behaviour “inform user”", ("rapp_say",), True),
    11: Figure("the dynamic agent's behaviour “recognise word”", ("rapp_recognize",), True),
    12: Figure("the dynamic agent's behaviour “send e-mail”", ("rapp_send_mail",), True, ("link", "mail-server")),
}


def figure(items: Sequence[Item], number: int) -> list[Item]:
    """The last call of that kind in the run, from the dynamic agent's request to the reply. Raises CommandError."""
    wanted = FIGURES[number]
    calls = [i for i, each in enumerate(items) if _asks(each) and each.text in wanted.services]
    for begin in reversed(calls):
        call = items[begin]
        reply = next((i for i in range(begin, len(items)) if items[i].kind == "reply" and answers(items[i], call)), None)
        if reply is not None:
            inside = [each for each in items[begin + 1 : reply] if _seen(each, wanted.shown)]
            waits = [Item("note", AGENT, AGENT, "suspended", call.time)] if wanted.of_agent else []
            return squeezed([call, *waits, *inside, items[reply]])
    raise CommandError(f"cannot draw figure {number}: in this run no {wanted.services[0]} has come to its end; give another folder")


def _asks(each: Item) -> bool:
    return (each.kind, each.source, each.target) == ("call", AGENT, CORE)


def _seen(each: Item, shown: Sequence[str]) -> bool:
    ends = {each.source, each.target}
    return len(ends) == 2 and bool(ends & set(shown)) and ends <= {CORE, *shown}
