"""multipart/form-data (RFC 7578) with bounds: ordered parts, few of them, short headers (inputs H07, H08). Pure."""

import re
from dataclasses import dataclass
from urllib.parse import unquote

from rapp_hop.errors import Invalid

MAX_PARTS = 32
MAX_PART_HEADERS = 2048  # bytes
_OPTION = re.compile(r';[ \t]*([a-zA-Z0-9_*-]{1,32})=(?:"([^"\\\r\n]{0,256})"|([^\s;"]{0,256}))[ \t]*', re.ASCII)


@dataclass(frozen=True)
class Part:
    """One field; `file_name` is None for a plain value."""

    name: str
    file_name: str | None
    data: bytes


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


def parse_multipart(body: bytes, boundary: str) -> list[Part]:
    """Return the parts in their order.

    :raises Invalid: when the boundary is missing, the body is cut off, or there are too many parts or headers
    """
    if not re.fullmatch(r"[0-9a-zA-Z'()+_,./:=? -]{1,70}", boundary, re.ASCII):
        raise Invalid("cannot read multipart: its boundary is missing or wrong")
    # With a line end in front every boundary looks the same; one that goes on in other letters is none.
    marks = re.compile(rb"\r\n--" + re.escape(boundary.encode()) + rb"(?=\r\n|--)")
    start, *pieces = marks.split(b"\r\n" + body, MAX_PARTS + 1)
    if start or not pieces:
        raise Invalid("cannot read multipart: it does not begin with its boundary")
    if pieces[-1].rstrip(b"\r\n") != b"--":
        raise Invalid(f"cannot read multipart: cut off, or more than {MAX_PARTS} parts")
    return [_part(piece) for piece in pieces[:-1]]


def _part(piece: bytes) -> Part:
    head, blank, data = piece.partition(b"\r\n\r\n")
    if not blank or not head.startswith(b"\r\n") or len(head) > MAX_PART_HEADERS:
        raise Invalid("cannot read multipart: the headers of a part are wrong")
    for line in head[2:].split(b"\r\n"):
        name, _, value = line.decode("utf-8", "replace").partition(":")
        if name.strip().lower() != "content-disposition":
            continue
        kind, options = parse_options(value)
        if kind == "form-data" and options.get("name"):
            file_name = options.get("filename")
            return Part(unquote(options["name"]), None if file_name is None else unquote(file_name), data)
    raise Invalid("cannot read multipart: a part has no name")
