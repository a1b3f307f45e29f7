"""The painted pictures are what detectors look for."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from rapp_nao_sim.world.pictures import paint
from rapp_nao_sim.world.room import PICTURES


@pytest.mark.parametrize("kind", PICTURES)
def test_every_picture_of_a_room_file_can_be_painted(kind: str) -> None:
    image = paint(kind, "text")
    assert image.dtype == np.uint8
    assert image.shape == (512, 512, 3)
    assert image.std() > 5
    assert np.array_equal(image, paint(kind, "text"))


def test_the_code_can_be_read() -> None:
    text, _, _ = cv2.QRCodeDetector().detectAndDecode(
        cv2.copyMakeBorder(paint("qr", "door 7"), 40, 40, 40, 40, 0, value=(255,) * 3)
    )
    assert text == "door 7"


def test_the_face_is_found_as_one_face() -> None:
    cascade = Path(cv2.__file__).parent / "data" / "haarcascade_frontalface_default.xml"
    grey = cv2.cvtColor(cv2.resize(paint("face"), (200, 200)), cv2.COLOR_BGR2GRAY)
    grey = cv2.copyMakeBorder(grey, 100, 100, 100, 100, cv2.BORDER_CONSTANT, value=(120,))
    assert len(cv2.CascadeClassifier(str(cascade)).detectMultiScale(grey, 1.1, 3)) == 1
