"""CBOR frames from clients (RFC 8949): the same objects as in JSON, with byte strings and typed arrays."""

from typing import Any

import cbor2

from rapp_bridge.arrays import DTYPES, Numbers
from rapp_bridge.errors import Invalid

DEPTH = 64  # of nested arrays and maps


def is_cbor(frame: bytes) -> bool:
    """Whether a binary frame begins as a CBOR map does; JSON in binary frames, which some clients send, does not."""
    return bool(frame) and 0xA0 <= frame[0] <= 0xBF


def read(frame: bytes) -> Any:
    """The value in a frame; typed arrays become `Numbers`. Raises Invalid."""
    try:
        return cbor2.loads(
            frame, tag_hook=_tagged, semantic_decoders=_REFUSED, max_depth=DEPTH, strict_hashable_types=True,
            allow_duplicate_keys=False,
        )  # fmt: skip
    except (cbor2.CBORError, ValueError, TypeError, ArithmeticError, LookupError, RecursionError) as error:
        raise Invalid(f"cannot read the message: {error.__cause__ or error}; send one CBOR map per frame") from error


def _refuse(_decoder: Any) -> Any:
    raise ValueError("only typed arrays may be tagged")


_REFUSED = dict.fromkeys((0, 1, 4, 5, 25, 28, 29, 30, 35, 36, 37, 100, 256, 258, 260, 261, 1004, 43000), _refuse)
"""Tags that cbor2 would make dates, fractions, patterns, cyclic structures and the like of."""


def _tagged(tag: Any, _immutable: bool) -> Any:
    dtype = DTYPES.get(tag.tag)
    if dtype is None or type(tag.value) is not bytes:
        raise ValueError(f"tag {tag.tag} is no typed array of numbers")
    if len(tag.value) % int(dtype[-1]):
        raise ValueError(f"a typed array of tag {tag.tag} ends within a number")
    return Numbers(dtype, tag.value)
