"""Versions of packages (SemVer 2.0.0 without build metadata) and conditions on the API version. Pure."""

import re
from dataclasses import dataclass

from rapp_hop.errors import Invalid

_NUMBER = r"(0|[1-9][0-9]{0,8})"
_LABEL = r"(?:0|[1-9][0-9]{0,8}|[0-9]*[a-zA-Z-][0-9a-zA-Z-]*)"
_VERSION = re.compile(rf"{_NUMBER}\.{_NUMBER}\.{_NUMBER}(?:-({_LABEL}(?:\.{_LABEL})*))?", re.ASCII)
_CONDITION = re.compile(rf"(>=|<=|==|>|<) ?{_NUMBER}\.{_NUMBER}", re.ASCII)
_API = re.compile(rf"{_NUMBER}\.{_NUMBER}", re.ASCII)
_TOLD = {">=": (0, 1), "<=": (-1, 0), "==": (0,), ">": (1,), "<": (-1,)}


@dataclass(frozen=True)
class Version:
    """A SemVer; `key` orders it (a pre-release comes before its release)."""

    text: str
    key: tuple[int, int, int, tuple[tuple[int, int, str], ...]]

    def __lt__(self, other: "Version") -> bool:
        """Tell whether this version comes first (SemVer 2.0.0 clause 11)."""
        return self.key < other.key

    def __str__(self) -> str:
        return self.text


def parse_version(text: str) -> Version:
    """Return the version that `text` spells exactly.

    :raises Invalid: when it is not MAJOR.MINOR.PATCH[-PRERELEASE], P26 of the hostile inputs
    """
    found = _VERSION.fullmatch(text) if len(text) <= 64 else None
    if found is None:
        raise Invalid(f"cannot use version {text[:70]!r}: write it like 1.0.0 or 1.0.0-rc.1")
    major, minor, patch, labels = found.groups()
    # A release comes after all its pre-releases: its one label sorts above every other.
    order = tuple(_label(part) for part in labels.split(".")) if labels else ((2, 0, ""),)
    return Version(text, (int(major), int(minor), int(patch), order))


def _label(part: str) -> tuple[int, int, str]:
    return (0, int(part), "") if part.isdecimal() else (1, 0, part)


def check_condition(condition: str) -> None:
    """Check a condition such as ">=1.0, <2.0".

    :raises Invalid: when it does not read so
    """
    for part in condition.split(","):
        if not _CONDITION.fullmatch(part.strip()):
            raise Invalid(f"cannot read the condition {condition[:70]!r}: write it like >=1.0 or >=1.0, <2.0")


def check_api(api: str) -> str:
    """Return an API version that reads right.

    :raises Invalid: when it is not MAJOR.MINOR
    """
    if not _API.fullmatch(api):
        raise Invalid(f"cannot read the API version {api[:70]!r}: write it like 1.0")
    return api


def satisfies(api: str, condition: str) -> bool:
    """Tell whether API version `api` (MAJOR.MINOR) meets the condition.

    :raises Invalid: when one of them does not read right
    """
    check_condition(condition)
    have = tuple(int(part) for part in check_api(api).split("."))
    for part in condition.split(","):
        found = _CONDITION.fullmatch(part.strip())
        assert found is not None  # check_condition saw it
        want = (int(found[2]), int(found[3]))
        if (have > want) - (have < want) not in _TOLD[found[1]]:
            return False
    return True
