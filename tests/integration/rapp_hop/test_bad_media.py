"""H13: pictures and recordings that are none, or lie about what they are, told as invalid by the services that read them."""

import struct
import zlib
from pathlib import Path
from typing import Any

import pytest

from fakes.hop_house import House, visit
from rapp_cloud.interpreter.errors import InterpreterError
from rapp_cloud.interpreter.sound import read_sound
from rapp_cloud.services.sight import sight_services
from rapp_hop.errors import Invalid, from_wire
from rapp_hop.service import service


def png(width: int, height: int, rows: bytes) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def wav(announced: int, samples: bytes, rate: int = 16000) -> bytes:
    form = struct.pack("<HHIIHH", 1, 1, rate, 2 * rate, 2, 16)
    data = b"WAVEfmt " + struct.pack("<I", len(form)) + form + b"data" + struct.pack("<I", announced) + samples
    return b"RIFF" + struct.pack("<I", len(data)) + data


PICTURES = {
    "nothing": b"",
    "text": b"no picture at all",
    "bomb": png(60_000, 60_000, bytes(1_000_000)),
    "bomb-in-both-numbers": png(2**31 - 1, 2**31 - 1, b""),
    "no-pixels": png(0, 0, b""),
    "only-a-head": png(64, 64, bytes(65 * 64))[:40],
    "html": b"<html><body>404</body></html>",
}
SOUNDS = {
    "nothing": b"",
    "text": b"no sound at all",
    "no-samples": wav(0, b""),
    "no-rate": wav(4, b"\0\0\0\0", rate=0),
    "too-long": wav(16000 * 2 * 61, bytes(16000 * 2 * 61)),
    "only-a-head": wav(1000, bytes(1000))[:20],
}


@service(max_body=8 * 2**20)
def listen(file: Path) -> int:
    """Read a sound as the interpreter does; the number of its samples."""
    try:
        return len(read_sound(file, longest=60.0))
    except InterpreterError as error:
        raise from_wire(error.kind, str(error)) from None


async def invalid(house: House, name: str, data: bytes, folder: Path) -> None:
    (folder / "sent").write_bytes(data)
    with pytest.raises(Invalid, match=r"^cannot ") as caught:
        await house.client.call(name, {"file": folder / "sent"}, timeout=60)
    assert caught.value.status == 400


@pytest.mark.timeout(240)
def test_h13_pictures(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        for data in PICTURES.values():
            for name in ("qr_detection", "hazard_detection_light_check"):
                await invalid(house, name, data, tmp_path)
        (tmp_path / "good").write_bytes(png(64, 64, bytes(65 * 64)))
        found: dict[str, Any] = await house.client.call("qr_detection", {"file": tmp_path / "good"}, timeout=60)
        assert found["qr_messages"] == []

    visit(test, tmp_path, *sight_services())


def test_h13_sounds(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        for data in SOUNDS.values():
            await invalid(house, "listen", data, tmp_path)
        # A header that promises more than there is: what is there is read, and no more is waited for.
        (tmp_path / "lying").write_bytes(wav(2**31 - 2, bytes(3200)))
        assert await house.client.call("listen", {"file": tmp_path / "lying"}) == 1600

    visit(test, tmp_path, listen)
