"""RApps in any number that differ in what one says for them, as those of many authors do. The same numbers give the same RApps."""

import itertools
import random

_VERBS = (
    "play read find show tell sing draw count bring check open close start stop order book call write send explain "
    "teach practise measure record translate remember plan compare repeat water feed clean pack sort fold paint build mend"
)
_KINDS = (
    "morning evening summer winter holiday birthday garden kitchen family school village mountain river ocean forest "
    "market music history science number letter picture story weather travel health sleep dinner breakfast exercise medicine"
)
_THINGS = (
    "news song poem recipe list puzzle quiz timer diary calendar report lesson game card letter map photograph message "
    "reminder menu ticket story joke riddle ball window lamp curtain plant bird"
)
_FORMS = (
    ("{verb} the {kind} {thing} for me", "would you {verb} my {kind} {thing}", "I want you to {verb} a {kind} {thing}"),
    ("can you {verb} the {kind} {thing}", "please {verb} another {kind} {thing}"),
)


def invented(count: int) -> list[tuple[str, list[str]]]:
    """Name and sentences of each.

    :raises ValueError: when there are not so many
    """
    every = list(itertools.product(_VERBS.split(), _KINDS.split(), _THINGS.split()))
    if count > len(every):
        raise ValueError(f"cannot invent {count} RApps: there are words for {len(every)}")
    chosen = random.Random(10_000).sample(every, count)
    return [
        (f"{verb}_{kind}_{thing}", [form.format(verb=verb, kind=kind, thing=thing) for form in _FORMS[number % len(_FORMS)]])
        for number, (verb, kind, thing) in enumerate(chosen)
    ]
