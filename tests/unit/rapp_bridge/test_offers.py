"""Services of clients beside a stand-in for rospy: when it is that callers are told is seen without any clock."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from types import SimpleNamespace
from typing import Any

import pytest
from rapp_msgs.srv import Say, SayRequest

from rapp_bridge import offers
from rapp_bridge.blocking import Blocking
from rapp_bridge.config import Config
from rapp_bridge.encoding import encode
from rapp_bridge.errors import BridgeError
from rapp_bridge.offers import Offers
from rapp_bridge.protocol import AdvertiseService, UnadvertiseService

HOUR = 3600.0  # s that callers are ready to wait
SERVICE = AdvertiseService("/s", "rapp_msgs/Say")
Leaving = Callable[[Offers, Any], Coroutine[Any, Any, None]]


async def vanish(served: Offers, provider: Any) -> None:
    served.abandon(provider)


async def withdraw(served: Offers, provider: Any) -> None:
    await served.unadvertise(provider, UnadvertiseService("/s"))


async def give_way(served: Offers, _provider: Any) -> None:
    await served.advertise(SimpleNamespace(), SERVICE)  # type: ignore[arg-type]


@pytest.mark.parametrize("leave", [vanish, withdraw, give_way])
def test_callers_are_told_in_the_moment_in_which_their_provider_leaves(leave: Leaving, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the same turn of the event loop, though the ROS master does not answer and they would wait for an hour."""
    told: list[Any] = []
    answers = threading.Event()
    monkeypatch.setattr(offers, "registered", lambda *_: SimpleNamespace(shutdown=lambda _reason: answers.wait(60)))

    async def story() -> None:
        served = Offers(Config(), Blocking(1))
        provider: Any = SimpleNamespace(send=lambda _frame: None)
        await served.advertise(provider, SERVICE)
        for _ in range(3):
            served.ask("/s", Say, encode({"text": "hello"}, SayRequest), HOUR, told.append)
        assert told == []
        leaving = asyncio.create_task(leave(served, provider))
        await asyncio.sleep(0)
        assert [isinstance(each, BridgeError) and "its provider has left" in str(each) for each in told] == [True] * 3
        answers.set()
        await leaving

    asyncio.run(story())
