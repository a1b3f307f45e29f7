"""RApps in any number that differ in what one says for them, as those of many authors do. The same numbers give the same RApps."""

import random
from importlib.util import find_spec
from pathlib import Path

_VERBS = (
    "play read find show tell sing draw count bring check open close start stop order book call write send explain "
    "teach practise measure record translate remember plan compare repeat water feed clean pack sort fold paint build mend"
)
_FORMS = (
    ("{verb} the {kind} {thing} for me", "would you {verb} my {kind} {thing}", "I want you to {verb} a {kind} {thing}"),
    ("can you {verb} the {kind} {thing}", "please {verb} another {kind} {thing}"),
)


def invented(count: int) -> list[tuple[str, list[str]]]:
    """Name and sentences of each; every RApp brings words of its own, as far as the language has some."""
    chance, words, verbs = random.Random(count), _words(), _VERBS.split()
    found: dict[str, list[str]] = {}
    while len(found) < count:
        verb, kind, thing = chance.choice(verbs), chance.choice(words), chance.choice(words)
        forms = _FORMS[len(found) % len(_FORMS)]
        found.setdefault(f"{verb}_{kind}_{thing}", [form.format(verb=verb, kind=kind, thing=thing) for form in forms])
    return list(found.items())


def _words() -> list[str]:
    """The whole words of the sentence model's vocabulary: English, the frequent ones first."""
    spec = find_spec("rapp_cloud.interpreter")
    assert spec is not None and spec.origin is not None
    lines = Path(spec.origin).with_name("wordpiece.txt").read_text("utf-8").splitlines()
    return [line for line in lines if line.isascii() and line.isalpha() and line.islower() and 4 <= len(line) <= 12]
