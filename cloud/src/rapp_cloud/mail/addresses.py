"""Which mail addresses are ours to deliver to. Pure."""

import re
from collections.abc import Collection

from rapp_cloud.mail.errors import Refused

MAX_ADDRESS = 254  # characters (RFC 5321 §4.5.3.1.3, without the angle brackets)
_LOCAL = re.compile(r"[A-Za-z0-9!#$%&'*+/=?^_`{|}~-]+(\.[A-Za-z0-9!#$%&'*+/=?^_`{|}~-]+)*")
_DOMAIN = re.compile(r"[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?(\.[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?)*")


def check_address(address: str, domains: Collection[str] = ()) -> str:
    """Return the address with its domain in lower case.

    Only plain forms pass (dot-atom, host name): no quotes, comments, spaces or control characters, so that an address
    written into a header can never begin another one.

    :param domains: domains served; none: every one
    :raises Refused: with the SMTP reply (553 malformed, 550 not served here)
    """
    local, _, domain = address.rpartition("@")
    if len(address) > MAX_ADDRESS or len(local) > 64 or not _LOCAL.fullmatch(local) or not _DOMAIN.fullmatch(domain):
        raise Refused(f"cannot use the address {address[:80]!r}", "553 5.1.3 malformed address")
    if domains and domain.lower() not in domains:
        raise Refused(f"cannot deliver to {address}: not a domain of ours", "550 5.7.1 relaying denied")
    return f"{local}@{domain.lower()}"
