"""multipart/form-data (RFC 7578) with bounds: ordered parts, few of them, short headers (inputs H07, H08). Pure.

The tolerant reading takes what the original RAPP clients send: a lone LF before a boundary or in a part's head, and no end
at all.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from mmap import mmap
from urllib.parse import unquote

from rapp_hop.errors import Invalid

MAX_PARTS = 32
MAX_PART_HEADERS = 2048  # bytes
_OPTION = re.compile(r';[ \t]*([a-zA-Z0-9_*-]{1,32})=(?:"([^"\\\r\n]{0,256})"|([^\s;"]{0,256}))[ \t]*', re.ASCII)


@dataclass(frozen=True, slots=True)
class Part:
    """One field; `file_name` is None for a plain value, `encoding` is Hop's part header `hop-encoding`."""

    name: str
    file_name: str | None
    data: bytes | memoryview
    encoding: str = ""

    @property
    def value(self) -> bytes:
        """The data as bytes of its own."""
        return bytes(self.data)


def parse_options(header: str) -> tuple[str, dict[str, str]]:
    """Return a header's value, in lower case, and its options: `form-data; name="x"` and such.

    :raises Invalid: when it does not read so
    """
    value, mark, rest = header.partition(";")
    options: dict[str, str] = {}
    text = mark + rest
    place = 0
    while place < len(text):
        found = _OPTION.match(text, place)
        if found is None or found[1].lower() in options:
            raise Invalid(f"cannot read the header {header[:80]!r}")
        options[found[1].lower()] = found[2] if found[2] is not None else found[3]
        place = found.end()
    return value.strip().lower(), options


def parse_multipart(body: bytes | mmap, boundary: str, *, tolerant: bool = False) -> list[Part]:
    """Return the parts in their order; their data are views of `body`.

    :raises Invalid: when the boundary is missing, the body is cut off, or there are too many parts or headers
    """
    if not re.fullmatch(r"[0-9a-zA-Z'()+_,./:=? -]{1,70}", boundary, re.ASCII):
        raise Invalid("cannot read multipart: its boundary is missing or wrong")
    return [_part(body, start, end, tolerant) for start, end in _pieces(body, boundary.encode(), tolerant)]


def _pieces(body: bytes | mmap, boundary: bytes, tolerant: bool) -> Iterator[tuple[int, int]]:
    line_end = rb"\r?\n" if tolerant else rb"\r\n"
    mark = re.compile(rb"(?:\A|" + line_end + rb")--" + re.escape(boundary) + rb"(--|" + line_end + rb")")
    begin, count, place = -1, 0, 0
    while (found := mark.search(body, place)) is not None:
        if begin < 0 and found.start() != 0:
            raise Invalid("cannot read multipart: it does not begin with its boundary")
        if begin >= 0:
            yield begin, found.start()
        if found[1] == b"--":
            if body[found.end() : found.end() + 16].strip(b"\r\n"):
                raise Invalid("cannot read multipart: something follows its end")
            return
        count += 1
        if count > MAX_PARTS:
            raise Invalid(f"cannot read multipart: more than {MAX_PARTS} parts")
        begin = found.end()
        place = begin - len(found[1])  # an empty part has its line end in common with the next boundary
    if begin < 0 or not tolerant:
        raise Invalid("cannot read multipart: cut off, or its boundary is not there")
    yield begin, len(body)


def _part(body: bytes | mmap, start: int, end: int, tolerant: bool) -> Part:
    head = bytes(body[start : min(end, start + MAX_PART_HEADERS + 4)])
    found = re.search(rb"\r?\n\r?\n" if tolerant else rb"\r\n\r\n", head)
    if found is None:
        raise Invalid("cannot read multipart: the headers of a part are wrong")
    name, file_name, encoding = _headers(head[: found.start()].decode("utf-8", "replace"))
    if not name:
        raise Invalid("cannot read multipart: a part has no name")
    return Part(name, file_name, memoryview(body)[start + found.end() : end], encoding)


def _headers(head: str) -> tuple[str, str | None, str]:
    name, file_name, encoding = "", None, ""
    for line in head.splitlines():
        title, _, value = line.partition(":")
        if title.strip().lower() == "hop-encoding":
            encoding = value.strip().lower()
        elif title.strip().lower() == "content-disposition":
            kind, options = parse_options(value)
            if kind == "form-data":
                name = unquote(options.get("name", ""))
                file_name = unquote(options["filename"]) if "filename" in options else None
    return name, file_name, encoding
