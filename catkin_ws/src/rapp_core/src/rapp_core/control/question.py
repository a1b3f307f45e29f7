"""State s12: what the person is asked when a long command fits several RApps, and what each answer means. Pure."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from rapp_core.control.installed import Known

NONE_OF_THEM = ("no", "neither")


@dataclass(frozen=True)
class Question:
    """A question, and the RApp that each answer names; None for an answer that refuses all."""

    text: str
    answers: Mapping[str, str | None]


def which(choice: Iterable[str], known: Mapping[str, Known]) -> Question:
    """Ask which RApp is meant; each is answered to by its name, and by those of its keywords that are its own."""
    names = list(dict.fromkeys(choice))
    answers: dict[str, str | None] = {_spoken(name): name for name in names}
    keywords = [(word, name) for name in names if name in known for word in dict.fromkeys(known[name].keywords)]
    users = Counter(word for word, _ in keywords)
    for word, name in keywords:
        if users[word] == 1:
            answers.setdefault(word, name)
    for word in NONE_OF_THEM:
        answers.setdefault(word, None)
    return Question(f"Do you mean {_listed([_spoken(name) for name in names])}?", answers)


def _spoken(name: str) -> str:
    return name.replace("_", " ")


def _listed(words: Sequence[str]) -> str:
    return " or ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
