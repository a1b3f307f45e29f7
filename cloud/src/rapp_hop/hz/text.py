"""Which texts and names may come out of a package. Pure."""

import re
import unicodedata

from rapp_hop.errors import Invalid

NAME = re.compile(r"[a-z][a-z0-9_]{0,63}", re.ASCII)
_HIDDEN = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}  # control, invisible, half, private, unassigned, line ends


def check_name(name: str) -> str:
    """Return `name` when it may name a package, a service or a robot.

    :raises Invalid: when it is not lower case letters, digits and underscores, 64 at most
    """
    if not NAME.fullmatch(name):
        raise Invalid(f"cannot use the name {name[:70]!r}: write a-z, 0-9 and _, a letter first, 64 at most")
    return name


def check_language(language: str, where: str) -> str:
    """Return `language` when it is one in two letters, as in ISO 639-1.

    :raises Invalid: when it is not; `where` it stands is told
    """
    if not (len(language) == 2 and language.isascii() and language.islower() and language.isalpha()):
        raise Invalid(f"cannot use the language {language[:20]!r} in {where}: write two letters such as en")
    return language


def check_text(text: str, limit: int, what: str) -> str:
    """Return `text` when a person may see or hear it.

    :param limit: characters
    :raises Invalid: when it is empty, too long, not in Unicode form C or holds characters that cannot be seen (P16)
    """
    if not text.strip() or len(text) > limit:
        raise Invalid(f"cannot use {what}: it must have 1 to {limit} characters")
    if not unicodedata.is_normalized("NFC", text):
        raise Invalid(f"cannot use {what}: write it in Unicode form C")
    if any(unicodedata.category(sign) in _HIDDEN for sign in text):
        raise Invalid(f"cannot use {what}: it holds a control or invisible character")
    return text
