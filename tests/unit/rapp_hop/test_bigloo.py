"""Bigloo's serialisation: recorded values, every kind, and what is broken or hostile."""

from typing import Any

import pytest

from rapp_hop import bigloo, hopjs
from rapp_hop.bigloo import UNDEFINED
from rapp_hop.errors import Invalid

HASH = b"\x02\xea\xb2"


@pytest.mark.parametrize(
    ("data", "value"),
    [
        (b"f\x01\x033.5", 3.5),
        (b"T", True),
        (b"F", False),
        (b".", None),
        (b";", UNDEFINED),
        (b"\x00", 0),
        (b"\x02\x01\x00", 256),
        (b"-\x01\x05", -5),
        (b'"\x01\x03\xc5\xbcy', "ży"),
        (b"%\x01\x03%41", "A"),
        (b"z\x01\x1499999999999999999999", 99999999999999999999),
        (b"a\x01A", "A"),
        (b"[\x01\x02\x01\x01T", [1, True]),
        (b"(\x01\x03\x01\x01\x01\x02.", [1, 2]),
        (b"c\x01\x01[\x01\x02=\x01\x01\"\x01\x01x#\x01\x01", ["x", "x"]),
        (b"h\x01\x02\x01\x02\"\x01\x03s16\xff\xff\x00\x02", [-1, 2]),
        (b"D\x01\x0e86400000000000", "1970-01-02T00:00:00.000Z"),
        (b"d\x01\x0586400", "1970-01-02T00:00:00.000Z"),
        # {a:1,b:{c:"d"}}, as native Hop 3.4 wrote it
        (
            b"c\x01\x02XO(\x01\x06" + HASH + b':"\x01\x01a\x01\x01:"\x01\x01bXO(\x01\x04' + HASH
            + b':"\x01\x01c"\x01\x01d.' + HASH + b"." + HASH,
            {"a": 1, "b": {"c": "d"}},
        ),
        # Buffer [0,1,200,255]
        (b"c\x01\x01XO(\x01\x02\x02\x5b\x13h\x01\x04\x01\x01\"\x01\x02u8\x00\x01\xc8\xff\x02\x5b\x13", bytes([0, 1, 200, 255])),
    ],
)  # fmt: skip
def test_values(data: bytes, value: Any) -> None:
    found = bigloo.loads(data)
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize("value", ["", "ż\n", 0, 5, -5, 2**70, 1.5, True, False, None, [], [1, ["x", None]], UNDEFINED])
def test_what_is_written_reads_back(value: Any) -> None:
    assert bigloo.loads(bigloo.dumps(value)) == value


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"?",
        b"\x20",
        b'"\x01\x05abc',
        b"f\x01\x03abc",
        b'"\x01\x01\xff',
        b"TT",
        b"#\x01\x01",
        b"#[\x00",
        b"f\x01\x03nan",
        b"f\x01\x051e400",
        b"f\x01\x041_.5",
        b"f\x01\x031_0",
        b"z\x01\x031_0",
        b"D\x01\x031_0",
        b"u\x02\xd8\x00",
        b"[\x01\x01u\x02\xdf\xff",
        b'h\x01\x01\x01\x08"\x01\x03f64\x7f\xf8' + bytes(6),
        b"=T\x01\x01",
        b"[\x04\xff\xff\xff\xff",
        b"[\x01\x01" * 300 + b"T",
        b'h\x01\x02\x01\x08"\x01\x02u8xxxx',
        b'h\x01\x02\x01\x01"\x01\x02q8xxxx',
        b"D\x01\x1699999999999999999999999",
        b"XO(\x01\x03" + HASH + b':"\x01\x01a.' + HASH,
    ],
)
def test_h12_broken_or_hostile(data: bytes) -> None:
    with pytest.raises(Invalid):
        bigloo.loads(data)


def _doubled(layers: int) -> bytes:
    """A vector in which each item holds the one before twice, by reference."""
    items = [b"=\x01\x01[\x01\x02TT"]
    items += [b"=\x01%c[\x01\x02#\x01%c#\x01%c" % (number, number - 1, number - 1) for number in range(2, layers + 1)]
    return b"[\x01%c" % (layers + 1) + b"".join(items)


_LAST = b"#\x01\x1e"
_TEXT = b'=\x01\x01"\x02\x40\x00' + b"x" * 2**14
_MANY = 2**11


@pytest.mark.parametrize(
    "data",
    [
        _doubled(30) + _LAST,  # a value
        _doubled(30) + b":" + _LAST,  # a keyword
        _doubled(30) + b'XO(\x01\x05\x00:"\x01\x01a\x01\x01' + _LAST + b"T\x00",  # a name that follows a name
        b"[\x02\x08\x01" + _TEXT + b"#\x01\x01" * _MANY,  # one long text, often
        b"[\x02\x08\x01" + _TEXT + b":#\x01\x01" * _MANY,  # one long keyword, often
        b'[\x02\x08\x01=\x01\x01[\x02\x08\x00:"\x01\x01k' + b"T" * (_MANY - 1) + b"O#\x01\x01T" * _MANY,  # fields of instances
        b'[\x02\x08\x01=\x01\x01h\x02\x40\x00\x01\x01"\x01\x02u8' + b"x" * 2**14 + b"#\x01\x01" * _MANY,  # octets, often
    ],
)
def test_h12_few_bytes_do_not_unfold_to_many(data: bytes) -> None:
    with pytest.raises(Invalid, match=r"too many|no text"):
        bigloo.loads(data)


def test_h12_a_value_that_holds_itself_ends() -> None:
    assert bigloo.loads(b"=\x01\x01[\x01\x01#\x01\x01") == [None]


def test_too_long() -> None:
    with pytest.raises(Invalid):
        bigloo.loads(b"T" * 11, limit=10)


@pytest.mark.parametrize("value", [{"a": 1}, b"x", object(), 2**200])
def test_what_cannot_be_written(value: Any) -> None:
    with pytest.raises(Invalid):
        bigloo.dumps(value)


def test_hopjs() -> None:
    text = '9.UZTFI2.-5N3.1.5S3.a.bs3.%41J7.{"a":1}'
    assert hopjs.loads(text) == [UNDEFINED, None, True, False, -5, 1.5, "a.b", "A", {"a": 1}]
    assert hopjs.loads("1.D8.86400000") == ["1970-01-02T00:00:00.000+00:00"]
    assert hopjs.loads("0.") == []


@pytest.mark.parametrize(
    "text",
    [
        "",
        "1",
        "1.",
        "1.X1.x",
        "1.S9.x",
        "1.I1.x",
        "1.N3.nan",
        "1.N3.1_0",
        "1.I3.1_0",
        "1.D3.1_0",
        "2.T",
        "1.TT",
        "999.T",
        "1.s3.%FF",
        "1.Dundefined.",
        "-1.",
    ],
)
def test_h12_hopjs_broken(text: str) -> None:
    with pytest.raises(Invalid):
        hopjs.loads(text)
