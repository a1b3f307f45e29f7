"""QR codes: all of a picture, with their places."""

import cv2
import numpy as np
import pytest

from fakes.drawn_room import draw_codes
from rapp_cloud.vision.codes import read_codes

CODES = (("left", 130, 150, 120), ("right", 500, 300, 160), ("below", 300, 390, 100))


def test_all_codes_with_their_middles_from_left_to_right() -> None:
    codes = read_codes(draw_codes(*CODES))
    assert [code.message for code in codes] == ["left", "below", "right"]
    places = {text: (x, y) for text, x, y, _ in CODES}
    for code in codes:
        assert code.centre == pytest.approx(places[code.message], abs=2)


def test_the_corners_are_those_of_the_code_as_it_is_read() -> None:
    side = 210  # of 25 modules with the border, 21 without
    (code,) = read_codes(draw_codes(("a code", 320, 240, side)))
    half = side / 2 * 21 / 25
    wanted = [(320 - half, 240 - half), (320 + half, 240 - half), (320 + half, 240 + half), (320 - half, 240 + half)]
    assert np.array(code.corners) == pytest.approx(np.array(wanted), abs=3)
    turned = cv2.rotate(draw_codes(("a code", 320, 240, side)), cv2.ROTATE_180)
    (code,) = read_codes(np.asarray(turned, np.uint8))
    assert code.corners[0] == pytest.approx((320 + half, 240 + half), abs=3)


def test_small_codes_are_found_in_an_enlarged_picture() -> None:
    small = cv2.resize(draw_codes(("small", 320, 240, 120)), (213, 160), interpolation=cv2.INTER_AREA)
    assert [code.message for code in read_codes(np.asarray(small, np.uint8))] == ["small"]


def test_two_codes_of_one_text_are_two() -> None:
    assert [code.message for code in read_codes(draw_codes(("twin", 150, 200, 140), ("twin", 450, 200, 140)))] == ["twin"] * 2


@pytest.mark.parametrize("side", [1, 10, 300])
def test_a_picture_without_codes_has_none(side: int) -> None:
    assert read_codes(np.full((side, side, 3), 128, np.uint8)) == []
