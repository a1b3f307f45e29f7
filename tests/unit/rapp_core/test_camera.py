"""The virtual receptor of pictures, with an ALVideoDevice that stalls or answers wrongly."""

from typing import Any

import pytest

from rapp_core.errors import CoreError, Unreachable
from rapp_core.robot.naoqi.camera import NaoqiCamera

WIDTH, HEIGHT = 160, 120
WHOLE = bytes(3 * WIDTH * HEIGHT)


def image(data: Any, width: int = WIDTH) -> list[Any]:
    """As NAOqi gives it."""
    return [width, HEIGHT, 3, 13, 5, 250_000, data, 0, 0.5, 0.4, -0.5, -0.4]


class Device:
    """A connection to NAOqi whose camera gives these pictures, one after another; an error is raised."""

    present = True

    def __init__(self, *images: Any) -> None:
        self._images = list(images)

    def service(self, _module: str) -> Any:
        return self

    def call(self, _module: str, method: str, *_args: Any) -> Any:
        if method != "getImageRemote":
            return "handle"
        found = self._images.pop(0)
        if isinstance(found, CoreError):
            raise found
        return found


def camera(*images: Any) -> NaoqiCamera:
    return NaoqiCamera(Device(*images), "test")  # type: ignore[arg-type]


WRONG = {
    "it stalls": (Unreachable("cannot wait for ALVideoDevice.getImageRemote: no answer in 5 s"),),
    "no picture": (None, None),
    "an empty list": ([], []),
    "no bytes": (image(b""), image(b"")),
    "half a picture": (image(WHOLE[:-1]),),
    "another encoding": (image(bytes(2 * WIDTH * HEIGHT)),),
    "another width": (image(WHOLE, WIDTH + 1),),
}


@pytest.mark.parametrize("images", WRONG.values(), ids=WRONG)
def test_r06_a_camera_that_gives_no_picture_is_told_and_the_next_one_is_taken(images: tuple[Any, ...]) -> None:
    receptor = camera(*images, image(WHOLE))
    with pytest.raises(Unreachable, match="cannot "):
        receptor.capture("top", 0)
    assert receptor.capture("top", 0).data == WHOLE


def test_the_first_picture_after_waking_may_be_missing() -> None:
    assert camera(None, image(WHOLE)).capture("top", 0).stamp == 5.25


def test_old_clients_see_bytes_as_text() -> None:
    data = bytes(range(256)) * 225
    assert camera(image(data.decode("latin-1"))).capture("bottom", 0).data == data
