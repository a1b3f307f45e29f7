"""hazard_detection_door_check, hazard_detection_light_check and qr_detection as HOP services of a running platform."""

import asyncio
import json
import os
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fakes.cloud_process import CloudProcess, cloud_process
from fakes.drawn_room import DoorScene, Image, draw_codes, draw_door, draw_lamp
from fakes.processes import children, stat
from rapp_hop.client import HopClient
from rapp_hop.errors import Invalid

TICKS = os.sysconf("SC_CLK_TCK")


@pytest.fixture(scope="module")
def cloud(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CloudProcess]:
    with cloud_process(tmp_path_factory.mktemp("sight"), []) as cloud:
        yield cloud


@pytest.fixture
def ask(cloud: CloudProcess, tmp_path: Path) -> Any:
    """Calls a service with a picture."""

    def call(service: str, picture: Image | bytes, **arguments: Any) -> Any:
        path = tmp_path / "picture"
        path.write_bytes(picture if isinstance(picture, bytes) else encoded(picture))
        answers: list[Any] = []

        async def test(client: HopClient, _other: HopClient) -> None:
            answers.append(await client.call(service, arguments, {"file": path}, 30))

        cloud.run(test)
        return answers[0]

    return call


def encoded(picture: Image, kind: str = ".png") -> bytes:
    return cv2.imencode(kind, picture)[1].tobytes()


@pytest.mark.parametrize(("angle", "opened"), [(0, False), (40, True), (90, True)])
def test_the_door_s_angle(ask: Any, angle: int, opened: bool) -> None:
    found = ask("hazard_detection_door_check", draw_door(replace(DoorScene(), angle=angle)))
    assert found["door_angle"] == pytest.approx(angle, abs=2)
    assert isinstance(found["door_angle"], int)
    assert found["open"] is opened
    assert found["confidence"] > 0.5


def test_what_is_not_sure_is_minus_one(ask: Any) -> None:
    grey = np.full((480, 640, 3), 128, np.uint8)
    assert ask("hazard_detection_door_check", grey) == {"door_angle": -1, "open": None, "confidence": 0.0}
    assert ask("hazard_detection_light_check", grey) == {"light_level": -1, "on": None, "confidence": 0.0}
    assert ask("qr_detection", grey) == {"qr_centers": [], "qr_messages": [], "qr_corners": []}


def test_the_lamp_s_level(ask: Any) -> None:
    on = ask("hazard_detection_light_check", draw_lamp((200, 235, 250), (150, 140, 130)))
    assert (on["light_level"], on["on"]) == (100, True)
    off = ask("hazard_detection_light_check", draw_lamp((50, 50, 50), (150, 140, 130)))
    assert (off["light_level"], off["on"]) == (0, False)


def test_codes_with_their_centres_in_the_same_order(ask: Any) -> None:
    found = ask("qr_detection", draw_codes(("one", 150, 200, 140), ("two", 480, 260, 160)))
    assert found["qr_messages"] == ["one", "two"]
    assert [(point["x"], point["y"]) for point in found["qr_centers"]] == [
        pytest.approx((150, 200), abs=2), pytest.approx((480, 260), abs=2),
    ]  # fmt: skip
    assert [len(corners) for corners in found["qr_corners"]] == [4, 4]


@pytest.mark.parametrize("service", ["hazard_detection_door_check", "hazard_detection_light_check", "qr_detection"])
@pytest.mark.parametrize(
    "data", [b"", b"no picture", encoded(np.zeros((90, 90, 3), np.uint8))[:60], b"\xff\xd8\xff\xe0" + bytes(100)]
)
def test_what_is_no_picture_is_invalid(ask: Any, service: str, data: bytes) -> None:
    with pytest.raises(Invalid, match="cannot read the picture"):
        ask(service, data)


def test_a_small_file_of_a_huge_picture_is_invalid(ask: Any) -> None:
    bomb = encoded(np.zeros((9000, 9000), np.uint8))
    assert len(bomb) < 200_000
    with pytest.raises(Invalid, match="cannot read the picture"):
        ask("qr_detection", bomb)


def test_a_camera_that_cannot_be_is_refused(ask: Any) -> None:
    picture = draw_door(DoorScene())
    assert ask("hazard_detection_door_check", picture, field_of_view=60.97)["open"] is False
    with pytest.raises(Invalid, match="20 to 120"):
        ask("hazard_detection_door_check", picture, field_of_view=500.0)


def test_clients_of_the_original_platform_get_its_fields(cloud: CloudProcess) -> None:
    """They send the file alone, and look at `error` first."""
    for service, picture, field, value in (
        ("hazard_detection_door_check", encoded(draw_door(DoorScene())), "door_angle", 0),
        ("hazard_detection_light_check", encoded(draw_lamp((40, 40, 40), (150, 150, 150)), ".jpg"), "light_level", 0),
        ("qr_detection", encoded(draw_codes(("one", 300, 200, 150))), "qr_messages", ["one"]),
    ):
        found = original_call(cloud, service, picture)
        assert (found["error"], found[field]) == ("", value)
    broken = original_call(cloud, "hazard_detection_door_check", b"no picture")
    assert broken["door_angle"] == -1
    assert "cannot read the picture" in broken["error"]


def original_call(cloud: CloudProcess, service: str, data: bytes) -> Any:
    """As the JavaScript and C++ clients do: no part named json."""
    head = b'--xyz\r\nContent-Disposition: form-data; name="file"; filename="a.png"\r\nContent-Type: image/png\r\n\r\n'
    request = urllib.request.Request(
        f"http://127.0.0.1:{cloud.port}/hop/{service}",
        head + data + b"\r\n--xyz--\r\n",
        {
            "Content-Type": "multipart/form-data; boundary=xyz",
            "Accept-Token": (cloud.data / "robots" / "nao.token").read_text().strip(),
        },
    )
    with urllib.request.urlopen(request, timeout=30) as answer:
        return json.load(answer)


def test_four_parallel_calls_take_two_rounds_of_two_workers(cloud: CloudProcess, tmp_path: Path) -> None:
    """Told by the workers' processor time, which a busy machine does not change: each did about two calls' work."""
    picture = tmp_path / "codes.png"
    codes = [(f"code {x} {y}", 200 + 260 * x, 160 + 260 * y, 140) for x in range(3) for y in range(2)]
    picture.write_bytes(encoded(draw_codes(*codes, size=(960, 600))))

    async def look(client: HopClient) -> None:
        found = await client.call("qr_detection", {}, {"file": picture}, 60)
        assert len(found["qr_messages"]) == 6

    async def test(client: HopClient, _other: HopClient) -> None:
        await asyncio.gather(*(look(client) for _ in range(4)))  # starts all workers
        before = spent(cloud)
        await look(client)
        single = sum(more(before, spent(cloud)).values())
        before = spent(cloud)
        await asyncio.gather(*(look(client) for _ in range(4)))
        shares = sorted(more(before, spent(cloud)).values(), reverse=True)
        count = min(4, len(os.sched_getaffinity(0)))
        assert len([share for share in shares if share > single / 3]) == count
        assert shares[0] < single * (-(-4 // count) + 0.8)

    cloud.run(test)


def spent(cloud: CloudProcess) -> dict[int, float]:
    """Processor time in s of each worker process of the platform."""
    assert cloud._process is not None
    found = {}
    for pid in children(cloud._process.pid):
        if b"rapp_hop.worker" in Path(f"/proc/{pid}/cmdline").read_bytes():
            fields = stat(pid)
            found[pid] = (int(fields[11]) + int(fields[12])) / TICKS
    return found


def more(before: dict[int, float], after: dict[int, float]) -> dict[int, float]:
    return {pid: seconds - before.get(pid, 0.0) for pid, seconds in after.items()}
