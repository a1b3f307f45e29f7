"""The port: what the rest of the cloud knows of interpretation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

Commands = Mapping[str, Sequence[str]]
"""Name of a RApp to the sentences its package.json gives for one language."""


@dataclass(frozen=True)
class Interpretation:
    """What a recording asks for (paper §III: the platform interprets the long command and names the RApp)."""

    rapp: str | None
    """Name of the RApp, or None: not understood, or `choice` is to be asked about."""
    confidence: float
    """Probability, 0..1, that the best candidate is what was meant; `rapp` is None when it is too low."""
    text: str
    """The words that were heard, lower case; "" when nothing was."""
    candidates: tuple[tuple[str, float], ...]
    """(RApp, confidence 0..1), best first, each RApp once; of a large catalogue only the best."""
    choice: tuple[str, ...] = ()
    """RApps that fit about as well as each other, best first: the person knows which is meant. Empty or at least two."""


class Interpreter(Protocol):
    """Says which RApp a recorded sentence asks for."""

    def interpret(self, recording: Path, commands: Commands, language: str = "en") -> Interpretation:
        """Interpret a recording (wav, ogg or flac, any rate) against the sentences of the RApps in `language`.

        Raises Invalid (no such recording, not sound, too long), Refused (a language that is not offered).
        """
        ...

    def learn(self, sentences: Sequence[str], language: str = "en") -> None:
        """Work out what takes long, before a recording is interpreted against these; nothing in a language not offered."""
        ...
