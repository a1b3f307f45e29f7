"""Who calls: the token of a request, and pages of other sites that call in the name of a browser's user. Pure."""

import base64
import binascii
from collections.abc import Mapping
from urllib.parse import urlsplit

from rapp_hop.errors import Refused


def token_of(headers: Mapping[str, str]) -> str | None:
    """Return the token of a request: `Accept-Token`, or `Authorization` (Bearer, or Basic with it as password).

    :raises Refused: with status 401, when there are two that differ
    """
    own = headers.get("accept-token")
    authorization = headers.get("authorization")
    if authorization is None:
        return own
    other = _authorized(authorization)
    if own is not None and own != other:
        raise Refused("cannot tell who calls: Accept-Token and Authorization differ", 401)
    return other


def _authorized(value: str) -> str | None:
    scheme, _, rest = value.partition(" ")
    if scheme.lower() == "bearer":
        return rest.strip()
    if scheme.lower() != "basic":
        return None
    try:
        return base64.b64decode(rest.strip(), validate=True).decode("utf-8").partition(":")[2]
    except (binascii.Error, UnicodeDecodeError):
        return None


def check_origin(headers: Mapping[str, str]) -> None:
    """A browser on somebody else's page must not call in the name of its user (input H20)."""
    origin = headers.get("origin")
    foreign = origin is not None and urlsplit(origin).netloc.lower() != headers.get("host", "").lower()
    if foreign or headers.get("sec-fetch-site") in ("cross-site", "same-site"):
        raise Refused("cannot serve another site's page: open the platform's own", 403)
