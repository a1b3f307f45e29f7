"""How a written phrase is split into spoken words."""

import re


def spoken_words(phrase: str) -> list[str]:
    """The words of a phrase in lower case; hyphens and apostrophes within a word stay: "E-Mail" is "e-mail"."""
    return re.findall(r"[^\W_]+(?:['\-][^\W_]+)*", phrase.lower())
