"""Secrets of the environment: which agent each is for; nobody else is told."""

from collections.abc import Mapping

from rapp_cloud.config import PREFIX
from rapp_cloud.keys import PASSPHRASE

CLOUD, LINK = "cloud", "link"
SECRETS = {
    "RAPP_SMTP_PASSWORD": LINK,
    PASSPHRASE: CLOUD,
    f"{PREFIX}DATABASE": CLOUD,  # a URL may hold a password
}


def confided(env: Mapping[str, str], agent: str) -> dict[str, str]:
    """The environment without the secrets that are not for this agent."""
    return {name: value for name, value in env.items() if SECRETS.get(name, agent) == agent}
