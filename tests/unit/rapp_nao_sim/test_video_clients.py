"""Subscriptions to the cameras, and what the cameras are set to."""

import pytest

from rapp_nao_sim.modules.video_clients import PER_NAME, Clients, Dials
from rapp_nao_sim.world import cameras


def test_a_client_waits_for_its_own_next_picture_only():
    now = [100.0]
    clients = Clients(clock=lambda: now[0])
    slow, fast = (clients.find(clients.add("x", 0, 1, cameras.BGR, rate)) for rate in (5, 20))
    assert (clients.wait(slow), clients.wait(fast)) == (0.0, 0.0)
    now[0] += 0.05
    assert clients.wait(slow) == pytest.approx(0.15)
    assert clients.wait(fast) == pytest.approx(0.0)
    now[0] += 10.0  # what it did not ask for is not made up for
    assert clients.wait(slow) == 0.0
    assert clients.wait(slow) == pytest.approx(0.2)


def test_handles_are_given_again():
    clients = Clients()
    handles = [clients.add("x", 0, 1, cameras.BGR, 5) for _ in range(PER_NAME + 1)]
    assert handles[-2:] == ["x_7", ""]
    assert clients.remove("x_2") is True
    assert clients.add("x", 1, 1, cameras.BGR, 5) == "x_2"
    assert [client.handle for client in clients.of(1)] == ["x_2"]
    assert clients.add("y", 0, 1, cameras.BGR, 5) == "y_0"


@pytest.mark.parametrize("rate", [0, 31, 2.5, "5"])
def test_a_wrong_rate_is_no_subscription(rate):
    assert Clients().add("x", 0, 1, cameras.BGR, rate) == ""


def test_what_an_automatism_governs_cannot_be_set_by_hand():
    dials = Dials()
    assert dials.set(cameras.EXPOSURE, 100) is False
    assert dials.set(cameras.WHITE, 3000) is False
    assert dials.set(cameras.AUTO_EXPOSURE, 0) and dials.set(cameras.AUTO_WHITE, 0)
    assert dials.set(cameras.EXPOSURE, 100) and dials.set(cameras.WHITE, 3000)
    assert dials.set(cameras.BRIGHTNESS, 80) is False
    assert (dials.get(cameras.EXPOSURE), dials.get(cameras.WHITE)) == (100, 3000)
    assert dials.reset(cameras.AUTO_EXPOSURE) is True
    dials.exposure = 321
    assert dials.get(cameras.EXPOSURE) == 321
    assert dials.reset() is True
    assert dials.settings() == cameras.defaults()


def test_what_is_not_known_or_only_told_cannot_be_set():
    dials = Dials()
    assert [dials.set(number, 1) for number in (99, cameras.RATE, cameras.RESOLUTION)] == [False] * 3
    assert dials.reset(99) is False
