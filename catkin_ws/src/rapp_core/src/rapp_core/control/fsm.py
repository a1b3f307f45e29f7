"""The core agent's FSM (paper Fig. 2). Only s9 is numbered in the paper's text; the other numbers are ours."""

from collections.abc import Callable
from typing import Protocol

from rapp_agent import Behaviour, Edge, Machine, Subsystem

Act = Callable[[Subsystem], None]
Ask = Callable[[Subsystem], bool]


class Acts(Protocol):
    """What the states do (transition functions) and when they end (terminal conditions)."""

    def initialise(self, share: Subsystem) -> None: ...  # noqa: D102
    def initialised(self, share: Subsystem) -> bool: ...  # noqa: D102
    def register(self, share: Subsystem) -> None: ...  # noqa: D102
    def listen(self, share: Subsystem) -> None: ...  # noqa: D102
    def heard(self, share: Subsystem) -> bool: ...  # noqa: D102
    def keyword(self, share: Subsystem) -> None: ...  # noqa: D102
    def long_command(self, share: Subsystem) -> None: ...  # noqa: D102
    def ask_which(self, share: Subsystem) -> None: ...  # noqa: D102
    def download(self, share: Subsystem) -> None: ...  # noqa: D102
    def activate(self, share: Subsystem) -> None: ...  # noqa: D102
    def await_first_word(self, share: Subsystem) -> None: ...  # noqa: D102
    def first_word_or_over(self, share: Subsystem) -> bool: ...  # noqa: D102
    def serve(self, share: Subsystem) -> None: ...  # noqa: D102
    def over(self, share: Subsystem) -> bool: ...  # noqa: D102
    def destroy(self, share: Subsystem) -> None: ...  # noqa: D102
    def apologise(self, share: Subsystem) -> None: ...  # noqa: D102


def failed(share: Subsystem) -> bool:
    """Whether the state has left a problem in memory, to be said aloud."""
    return share.memory.get("problem") is not None


def is_keyword(share: Subsystem) -> bool:
    """Whether what was heard is an isolated keyword."""
    return share.memory.get("keyword") is not None


def is_unclear(share: Subsystem) -> bool:
    """Whether what was heard fits several RApps."""
    return bool(share.memory.get("choice"))


def core_machine(acts: Acts) -> Machine:
    """Build the FSM; any failure leads to s11, which says it aloud, and back to s3."""
    states = {
        "s1": Behaviour("s1", acts.initialise, acts.initialised, label="initialise"),
        "s2": Behaviour("s2", acts.register, label="register"),
        "s3": Behaviour("s3", acts.listen, acts.heard, label="listen"),
        "s4": Behaviour("s4", acts.keyword, label="keyword"),
        "s5": Behaviour("s5", acts.long_command, label="long command"),
        "s6": Behaviour("s6", acts.download, label="download"),
        "s7": Behaviour("s7", acts.activate, label="activate"),
        "s8": Behaviour("s8", acts.await_first_word, acts.first_word_or_over, label="await first word"),
        "s9": Behaviour("s9", acts.serve, acts.over, label="await and execute commands"),
        "s10": Behaviour("s10", acts.destroy, label="destroy"),
        "s11": Behaviour("s11", acts.apologise, label="say what failed"),
        "s12": Behaviour("s12", acts.ask_which, label="ask which is meant"),
    }
    edges = [
        Edge("s1", "s2"),
        Edge("s2", "s3"),
        Edge("s3", "s11", failed, "failed"),
        Edge("s3", "s4", is_keyword, "keyword"),
        Edge("s3", "s5", label="long command"),
        Edge("s4", "s11", failed, "failed"),
        Edge("s4", "s6"),
        Edge("s5", "s11", failed, "not understood"),
        Edge("s5", "s12", is_unclear, "fits several"),
        Edge("s5", "s6", label="interpreted"),
        Edge("s12", "s11", failed, "no answer"),
        Edge("s12", "s6", label="answered"),
        Edge("s6", "s11", failed, "failed"),
        Edge("s6", "s7"),
        Edge("s7", "s11", failed, "failed"),
        Edge("s7", "s8"),
        Edge("s8", "s10", failed, "failed"),
        Edge("s8", "s9", label="first word"),
        Edge("s9", "s10", label="finished or failed"),
        Edge("s10", "s11", failed, "failed"),
        Edge("s10", "s3"),
        Edge("s11", "s3"),
    ]
    return Machine("core", states, "s1", edges, finals=[], failure="s11")
