"""What the cameras' parameters make of the light."""

import numpy as np
import numpy.typing as npt
import pytest

from rapp_nao_sim.world import cameras
from rapp_nao_sim.world.developing import REACH, develop, exposed

Picture = npt.NDArray[np.uint8]


def plain(level: int) -> Picture:
    return np.full((12, 16, 3), level, np.uint8)


def settings(**changes: int) -> dict[int, int]:
    return cameras.defaults() | {getattr(cameras, name): value for name, value in changes.items()}


def developed(light: Picture, colour: int = cameras.RGB, **changes: int) -> Picture:
    data, _ = develop(light, settings(**changes), colour)
    return np.frombuffer(data, np.uint8).reshape(*light.shape[:2], cameras.LAYERS[colour])


def test_the_automatic_exposure_evens_out_within_its_reach() -> None:
    means = [developed(plain(level)).mean() for level in (110, 140, 180)]
    assert max(means) - min(means) < 2
    assert developed(plain(20)).mean() == pytest.approx(20 * REACH[1], abs=2)
    assert exposed(plain(255), settings(BRIGHTNESS=0)) == REACH[0]


def test_exposure_by_hand_multiplies_time_and_gain() -> None:
    assert exposed(plain(90), settings(AUTO_EXPOSURE=0)) == 1.0
    assert exposed(plain(90), settings(AUTO_EXPOSURE=0, EXPOSURE=500, GAIN=48)) == 3.0
    assert developed(plain(90), AUTO_EXPOSURE=0, EXPOSURE=2500).min() == 255


def test_the_exposure_is_metered_as_chosen() -> None:
    light = plain(60)
    light[3:9, 4:12] = 200
    whole, middle = (exposed(light, settings(METERING=method)) for method in (0, 1))
    assert middle < whole
    assert exposed(light, settings(METERING=1, BACKLIGHT=4)) < middle
    assert exposed(light, settings(METERING=2)) < exposed(light, settings(METERING=3))


def test_white_balance() -> None:
    yellow = plain(120)
    yellow[..., 2] = 60
    left = developed(yellow, AUTO_WHITE=0, AUTO_EXPOSURE=0)[0, 0]
    assert tuple(left) == (120, 120, 60)
    automatic = developed(yellow, AUTO_EXPOSURE=0)[0, 0]
    assert 60 < automatic[2] < 120
    warm, cold = (developed(plain(120), AUTO_WHITE=0, WHITE=kelvin, AUTO_EXPOSURE=0)[0, 0] for kelvin in (6500, 2700))
    assert warm[0] > warm[2]
    assert cold[0] < cold[2]


def test_contrast_is_about_the_middle() -> None:
    light = np.concatenate([plain(100), plain(156)])
    steep, flat = (developed(light, CONTRAST=value, AUTO_EXPOSURE=0).astype(int) for value in (64, 16))
    assert np.ptp(steep) == pytest.approx(2 * 56, abs=2)
    assert np.ptp(flat) == pytest.approx(28, abs=2)


def test_hue_turns_colours_right_round() -> None:
    red = plain(60)
    red[..., 0] = 160
    there = developed(red, HUE=180, AUTO_WHITE=0, AUTO_EXPOSURE=0)[0, 0].astype(int)
    assert there[0] < there[1]
    full = developed(red, SATURATION=128, HUE=0, AUTO_WHITE=0, AUTO_EXPOSURE=0)[0, 0]
    assert tuple(full) == (160, 60, 60)


def test_pairs_carry_a_colour_between_two_pixels() -> None:
    pairs = developed(plain(100), cameras.YUV422, AUTO_WHITE=0, AUTO_EXPOSURE=0)
    assert pairs.shape == (12, 16, 2)
    assert (pairs[..., 0] == 100).all()
    assert (pairs[..., 1] == 128).all()


@pytest.mark.parametrize("colour", cameras.LAYERS)
def test_every_colour_space_has_its_bytes(colour: int) -> None:
    data, exposure = develop(plain(128), cameras.defaults(), colour)
    assert len(data) == 12 * 16 * cameras.LAYERS[colour]
    assert exposure > 0
