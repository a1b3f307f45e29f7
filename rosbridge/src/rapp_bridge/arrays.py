"""Arrays of numbers as CBOR carries them: one type for all, in one run of bytes (RFC 8746)."""

from dataclasses import dataclass

import numpy as np

from rapp_bridge.rostypes import CODES

LITTLE_ENDIAN_TAGS = {
    "uint16": 69, "uint32": 70, "uint64": 71, "int8": 72, "byte": 72, "int16": 77, "int32": 78, "int64": 79,
    "float32": 85, "float64": 86,
}  # fmt: skip
"""Number type to the tag that the bridge writes."""

DTYPES = {
    64: "u1", 65: ">u2", 66: ">u4", 67: ">u8", 68: "u1", 69: "<u2", 70: "<u4", 71: "<u8", 72: "i1", 73: ">i2", 74: ">i4",
    75: ">i8", 77: "<i2", 78: "<i4", 79: "<i8", 80: ">f2", 81: ">f4", 82: ">f8", 84: "<f2", 85: "<f4", 86: "<f8",
}  # fmt: skip
"""Tag to numpy's name of the numbers, for all that are read."""


@dataclass(frozen=True)
class Numbers:
    """A typed array that a client sent."""

    dtype: str
    data: bytes

    def __len__(self) -> int:
        return len(self.data) // np.dtype(self.dtype).itemsize

    def packed(self, code: str) -> bytes:
        """The numbers little-endian as the type of this struct code; raises ValueError when one does not fit it."""
        target = np.dtype("<" + code)
        if np.dtype(self.dtype) == target:
            return self.data
        given = np.frombuffer(self.data, self.dtype)
        if given.dtype.kind == "f" and target.kind != "f":
            raise ValueError("integers are needed, not floats")
        with np.errstate(over="ignore"):
            converted = given.astype(target)
        if target.kind != "f" and not np.array_equal(converted.astype(object), given.astype(object)):
            raise ValueError(f"a number does not fit {_type_of(code)}")
        return converted.tobytes()


def _type_of(code: str) -> str:
    return next(name for name, other in CODES.items() if other == code)
