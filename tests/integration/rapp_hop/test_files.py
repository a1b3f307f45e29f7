"""Files and streams, both ways, in pieces; and what the client does when they break off."""

import asyncio
import hashlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fakes.hop_house import House, read_answer, request, visit
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.results import File, Stream
from rapp_hop.service import service

BIG = 40 * 2**20  # bytes


@service(max_body=BIG + 2**20)
def digest(file: Path, label: str = "") -> dict[str, Any]:
    """Say what a file is."""
    data = file.read_bytes()
    return {"size": len(data), "sha256": hashlib.sha256(data).hexdigest(), "label": label}


@service(max_body=BIG + 2**20)
def back(file: Path) -> Path:
    """Send the file back; it is there until it is sent."""
    return file


@service
def lines(count: int) -> Stream:
    """Stream from a plain function."""

    def pieces() -> Iterator[bytes]:
        for number in range(count):
            yield b"%d\n" % number

    return Stream(pieces(), "text/plain", "lines.txt")


def test_a_large_file_goes_up_and_comes_back(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        path = tmp_path / "voice.wav"
        path.write_bytes(os.urandom(BIG))
        expected = hashlib.sha256(path.read_bytes()).hexdigest()
        found = await house.client.call("digest", {"file": path, "label": "x"}, timeout=60)
        assert found == {"size": BIG, "sha256": expected, "label": "x"}
        assert await house.client.fetch("back", {"file": path}, tmp_path / "copy", BIG, timeout=60) == BIG
        assert hashlib.sha256((tmp_path / "copy").read_bytes()).hexdigest() == expected
        async with asyncio.timeout(20):
            while list((tmp_path / "uploads").iterdir()):  # nothing stays with the server
                await asyncio.sleep(0.01)

    visit(test, tmp_path, digest, back)


def test_a_file_too_large_is_refused_before_it_is_sent(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        path = tmp_path / "large"
        path.write_bytes(bytes(8 * 2**20))
        with pytest.raises(Refused) as caught:
            await house.client.call("measure", {"file": path})
        assert (caught.value.status, house.ran) == (413, 0)

    visit(test, tmp_path)


def test_files_and_streams_of_services(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        client = house.client
        told: list[int] = []
        count = await client.fetch("numbers", {"count": 5}, tmp_path / "a", 100, on_progress=lambda done, _: told.append(done))
        assert (count, (tmp_path / "a").read_bytes(), told[-1]) == (50, b"0123456789" * 5, 50)
        assert not (house.folder / "numbers.txt").exists()  # remove=True
        await client.fetch("drip", {"count": 3}, tmp_path / "b", 100)
        assert (tmp_path / "b").read_bytes() == b"0;1;2;"
        await client.fetch("lines", {"count": 3}, tmp_path / "c", 100)
        assert (tmp_path / "c").read_bytes() == b"0\n1\n2\n"
        answer = read_answer(await house.send(request("/hop/numbers", b'{"count": 1}')))
        assert answer.headers["content-disposition"] == "attachment; filename*=UTF-8''numbers.txt"

    visit(test, tmp_path, lines)


def test_what_breaks_off_leaves_no_file(tmp_path: Path) -> None:
    @service
    async def gone() -> File:
        return File(tmp_path / "is not there")

    async def test(house: House) -> None:
        cases: list[tuple[str, dict[str, Any], type[HopError]]] = [
            ("drip", {"count": 3, "fail": True}, Unreachable),  # cut, and not taken for the whole
            ("numbers", {"count": 50}, Invalid),  # longer than allowed
            ("numbers", {"count": "x"}, Invalid),
            ("nix", {}, Refused),
            ("gone", {}, Bug),
        ]
        for name, args, leaf in cases:
            (tmp_path / "kept").write_text("old")
            with pytest.raises(leaf):
                await house.client.fetch(name, args, tmp_path / "kept", 100)
            assert (tmp_path / "kept").read_text() == "old"
            assert not list(tmp_path.glob(".kept*"))
        with pytest.raises(Invalid, match="must be a whole number"):  # the service's own words arrive
            await house.client.fetch("numbers", {"count": "x"}, tmp_path / "kept", 100)
        with pytest.raises(Invalid, match="fetch"):
            await house.client.call("drip", {"count": 1, "fail": False})
        assert await house.alive()

    visit(test, tmp_path, gone)


def test_old_http_gets_a_stream_to_its_end(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        data = request("/hop/drip", b'{"count": 3}').replace(b"HTTP/1.1", b"HTTP/1.0", 1)
        head, _, body = (await house.send(data)).partition(b"\r\n\r\n")
        assert b"chunked" not in head and body == b"0;1;2;"

    visit(test, tmp_path)


def test_a_file_that_cannot_be_read_is_not_sent(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        for path in (tmp_path / "nowhere", tmp_path):
            with pytest.raises(Refused, match="cannot upload"):
                await house.client.call("measure", {"file": path})
        assert house.ran == 0

    visit(test, tmp_path)
