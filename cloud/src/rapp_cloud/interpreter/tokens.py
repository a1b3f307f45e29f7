"""The speech model's vocabulary: text pieces and their numbers.

`tokenizer.bin` of Moonshine is a list of 32768 byte strings, each after its length in one byte (two, low seven bits
first, from 128 on). Pieces begin with "▁" where a word begins; the numbers are merge ranks of a byte-pair encoding.
"""

from collections.abc import Sequence
from pathlib import Path

from rapp_cloud.interpreter.errors import Bug

START, END = 1, 2
"""Numbers of the marks before the first and after the last piece."""
_FIRST_BYTE = 3
_WORD_START = "▁"


class Vocabulary:
    """Turns piece numbers into text and back."""

    def __init__(self, pieces: list[bytes]) -> None:
        self._pieces = pieces
        # single ASCII characters occur twice, as byte and as piece: the model writes the piece, which comes later
        self._numbers = {piece: number for number, piece in enumerate(pieces)}

    def __len__(self) -> int:
        return len(self._pieces)

    def text(self, numbers: Sequence[int]) -> str:
        """The text of piece numbers, marks and `<<…>>` control pieces left out."""
        kept = [self._pieces[n] for n in numbers if n >= _FIRST_BYTE and not self._pieces[n].startswith(b"<<")]
        return b"".join(kept).decode("utf-8", errors="ignore").replace(_WORD_START, " ").strip()

    def numbers(self, text: str) -> list[int]:
        """The piece numbers of a text, without marks; what has no piece is spelled in bytes."""
        parts = list(_WORD_START + text.replace(" ", _WORD_START))
        while True:
            ranked = [
                (self._numbers[joined], place)
                for place in range(len(parts) - 1)
                if (joined := (parts[place] + parts[place + 1]).encode()) in self._numbers
            ]
            if not ranked:
                break
            _, place = min(ranked)
            parts[place : place + 2] = [parts[place] + parts[place + 1]]
        return [number for part in parts for number in self._piece_numbers(part.encode())]

    def _piece_numbers(self, piece: bytes) -> list[int]:
        number = self._numbers.get(piece)
        return [number] if number is not None else [_FIRST_BYTE + byte for byte in piece]


def read_vocabulary(file: Path) -> Vocabulary:
    """The vocabulary in a `tokenizer.bin`; raises Bug when it is cut off."""
    data = file.read_bytes()
    pieces, place = [], 0
    while place < len(data):
        length, place = data[place], place + 1
        if length >= 128:
            length, place = (length & 127) | (data[place] << 7), place + 1
        pieces.append(data[place : place + length])
        place += length
    if place != len(data):
        raise Bug(f"cannot read the speech model's vocabulary {file.name}: it is cut off; install the packages again")
    return Vocabulary(pieces)
