"""Why something was not installed, not interpreted, not started or not delivered, in words for the person. Pure."""

from collections.abc import Sequence

from rapp_core.errors import NO_RUNTIME, CoreError, Unreachable

AWAY = "I cannot reach the platform"
ODD = "The platform does not answer as it should"

_ATTACKS = {  # the link's reasons are TUF's names of attacks (rapp_hop.hz.attacks)
    "unsigned or signed by a wrong key": "it is not signed by my store",
    "wrong hash or length": "it was changed on its way",
    "rollback": "it is older than what I had",
    "freeze": "the store shows me an old state",
    "mix-and-match": "the store's lists do not fit each other",
    "endless data": "it is longer than it should be",
    "malformed metadata": "the store's lists are broken",
    "slow retrieval": "it comes too slowly",
    "replay to another robot": "it is for another robot",
    "wrong clock": "my clock is wrong",
    "revoked key": "who made it is not trusted any more",
}


def not_installed(name: str, error: CoreError) -> str:
    """What to say of a RApp that was not installed."""
    spoken = name.replace("_", " ")
    why = _ATTACKS.get(error.reason)
    if why:
        return f"I refuse to install {spoken}, {why}"
    return AWAY if isinstance(error, Unreachable) else f"I cannot install {spoken}"


def not_interpreted(error: CoreError) -> str:
    """What to say of a long command that was not interpreted."""
    return AWAY if isinstance(error, Unreachable) else ODD


def not_started(error: CoreError) -> str:
    """What to say of a RApp whose cloud agent was not started."""
    return AWAY if isinstance(error, Unreachable) else "I cannot start its part in the cloud"


def not_delivered(recipients: Sequence[str]) -> str:
    """What to say of a mail that was kept, and that the mail server has then refused, or not taken for days."""
    return f"The mail server does not take your message to {' and '.join(recipients)}, I could not send it, and keep it"


def not_activated(error: CoreError) -> str:
    """What to say of a RApp whose dynamic agent was not started."""
    return "I cannot start it, I lack what it is written in" if error.reason == NO_RUNTIME else "I cannot start it"
