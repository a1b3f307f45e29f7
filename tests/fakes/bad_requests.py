"""Requests that no HOP server may take: each is refused, alone and behind a good neighbour, and harms nobody else."""

from pathlib import Path

from fakes.hop_house import Answer, House, read_answers, request, visit
from rapp_hop.server import ServerLimits

MULTIPART = "multipart/form-data; boundary=B"
PART = b'--B\r\nContent-Disposition: form-data; name="json"\r\n\r\n{}\r\n'
SLOW = ServerLimits(header_timeout=0.3, body_timeout=0.3)
CHUNKED = b"Transfer-Encoding: chunked"


async def refused(house: House, status: int, *pieces: bytes) -> Answer:
    """Send pieces, alone and behind a good neighbour; the same error must come, and nothing run but the neighbour."""
    alone = read_answers(await house.send(*pieces))
    before = house.ran
    good = request(body=b'{"value": "neighbour"}', keep=True)
    both = read_answers(await house.send(good + pieces[0], *pieces[1:]))
    assert [answer.status for answer in alone] == [status]
    assert [answer.status for answer in both] == [200, status]
    assert (both[0].json, house.ran) == ("neighbour", before + 1)
    for answer in (alone[0], both[1]):
        assert answer.headers["connection"] == "close"
        assert answer.json["error"]["kind"] in ("refused", "invalid", "unreachable")
        assert answer.json["error"]["message"].startswith("cannot ")
    assert await house.alive()
    return alone[0]


def bad(tmp_path: Path, status: int, *pieces: bytes, limits: ServerLimits | None = None) -> None:
    async def test(house: House) -> None:
        await refused(house, status, *pieces)

    visit(test, tmp_path, limits=limits)


async def invalid(house: House, body: bytes, kind: str, *lines: str, status: int = 400) -> Answer:
    answer = await house.ask(request("/hop/measure", body, "Accept: application/json", *lines, kind=kind))
    assert answer.status == status, answer
    assert answer.json["error"]["message"].startswith("cannot ")
    assert house.ran == 0
    return answer
