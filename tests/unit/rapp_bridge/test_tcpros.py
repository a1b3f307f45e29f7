import struct

import pytest

from rapp_bridge.tcpros import decode_header, encode_header


def test_a_header_goes_there_and_back() -> None:
    fields = {"service": "/say", "md5sum": "*", "message": "a=b\nc=ä"}
    frame = encode_header(fields)
    assert struct.unpack_from("<I", frame) == (len(frame) - 4,)
    assert decode_header(frame[4:]) == fields


@pytest.mark.parametrize("size", [1, 2, 3])
def test_a_cut_header_is_noticed(size: int) -> None:
    with pytest.raises(struct.error):
        decode_header(b"\x01" * size)
