"""The ROS half of the link, over rosbridge with roslibpy: offers rapp_hop/*, publishes events and signs of life.

roslibpy's callbacks run one after another in its reactor's thread: they only hand over to the event loop and answer at once.
"""

import asyncio
import json
import logging
import secrets
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import Any
from urllib.parse import urlsplit

import roslibpy

from rapp_link.jobs import Jobs

_log = logging.getLogger(__name__)
HAND_OVER = 2.0  # s for the event loop to take a job
CONNECT_TIMEOUT = 3.0  # s of one try
PROGRESS, DONE, FAILED = 0, 1, 2  # rapp_msgs/HopEvent


class RosSide:
    """The connection to rosbridge; roslibpy connects again by itself after a loss, and everything is offered anew then."""

    def __init__(self, bridge: str, loop: asyncio.AbstractEventLoop) -> None:
        url = urlsplit(bridge)
        self._ros = roslibpy.Ros(host=url.hostname, port=url.port or 9090, is_secure=url.scheme == "wss")
        self._loop = loop
        self._boot = secrets.token_hex(4)
        self._events = roslibpy.Topic(self._ros, "rapp_hop/events", "rapp_msgs/HopEvent", queue_size=1000)
        self._alive = roslibpy.Topic(self._ros, "rapp_hop/alive", "std_msgs/String", queue_size=10)
        self._cancel = roslibpy.Topic(self._ros, "rapp_hop/cancel", "std_msgs/String")
        self._services: list[Any] = []

    async def connect(self) -> None:
        """Connect, trying until it works. Ends by cancelling."""
        while not self._ros.is_connected:
            try:
                await asyncio.to_thread(self._ros.run, CONNECT_TIMEOUT)
            except Exception as error:  # noqa: BLE001 - roslibpy raises its own and twisted's; all mean: not yet
                _log.warning("rosbridge is away: %s", error)
                await asyncio.sleep(0.5)

    def offer(self, names: Iterable[str], jobs: Jobs) -> None:
        """Offer the services; `jobs` is used in the event loop only."""
        for name in names:
            service = roslibpy.Service(self._ros, f"rapp_hop/{name}", "rapp_msgs/HopRequest")
            service.advertise(self._handler(name, jobs))
            self._services.append(service)
        self._cancel.subscribe(lambda message: self._loop.call_soon_threadsafe(jobs.cancel, message["data"]))

    def _handler(self, name: str, jobs: Jobs) -> Callable[[Any, Any], bool]:
        def handle(request: Any, response: Any) -> bool:
            accepted: Future[str] = Future()

            def accept() -> None:
                try:
                    accepted.set_result(jobs.accept(name, request["job"], request["arguments"], request["timeout"]))
                except (KeyError, TypeError) as error:
                    accepted.set_result(f"cannot read the request: {error}")

            self._loop.call_soon_threadsafe(accept)
            try:
                response["message"] = accepted.result(HAND_OVER)
            except FutureTimeoutError:
                response["message"] = "cannot take the job: the link is too busy"
            response["accepted"] = response["message"] == ""
            return True

        return handle

    def sign_of_life(self, cloud_present: bool) -> None:
        """Publish that the link is there."""
        if self._ros.is_connected:
            self._alive.publish(roslibpy.Message({"data": json.dumps({"boot": self._boot, "cloud": cloud_present})}))

    def progress(self, job: str, phase: str, fraction: float) -> None:
        """See `jobs.Events`."""
        self._tell(job, PROGRESS, phase=phase, fraction=fraction)

    def done(self, job: str, result: str) -> None:
        """See `jobs.Events`."""
        self._tell(job, DONE, result=result)

    def failed(self, job: str, kind: str, message: str) -> None:
        """See `jobs.Events`."""
        self._tell(job, FAILED, error=kind, message=message)

    def _tell(self, job: str, kind: int, **fields: Any) -> None:
        self._events.publish(roslibpy.Message({"job": job, "kind": kind, **fields}))

    async def close(self) -> None:
        """Leave rosbridge."""
        await asyncio.to_thread(self._ros.terminate)
