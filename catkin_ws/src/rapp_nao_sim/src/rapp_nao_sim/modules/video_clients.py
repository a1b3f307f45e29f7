"""Who has subscribed to ALVideoDevice, and what the cameras are set to."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from rapp_nao_sim.world import cameras
from rapp_nao_sim.world.cameras import CAMERAS, FASTEST, LAYERS, PARAMETERS, SIZES, Settings

PER_NAME = 8  # subscriptions with one name: name_0 to name_7

_log = logging.getLogger(__name__)
_NEEDS = {  # what can be set only while an automatism is on (1) or off (0)
    cameras.BRIGHTNESS: (cameras.AUTO_EXPOSURE, 1),
    cameras.EXPOSURE: (cameras.AUTO_EXPOSURE, 0),
    cameras.GAIN: (cameras.AUTO_EXPOSURE, 0),
    cameras.WHITE: (cameras.AUTO_WHITE, 0),
}


@dataclass
class Client:
    """One subscription."""

    handle: str
    camera: int
    resolution: int
    colour: int
    rate: int  # pictures per second
    due: float = 0.0  # when its next picture is ready, on the monotonic clock


class Clients:
    """Subscriptions by handle."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._clients: dict[str, Client] = {}

    def add(self, name: str, camera: int, resolution: int, colour: int, rate: int) -> str:
        """The handle of a new subscription; empty, as NAOqi's, when it cannot be."""
        wrong = _wrong(name, camera, resolution, colour, rate)
        with self._lock:
            free = next((h for h in (f"{name}_{i}" for i in range(PER_NAME)) if h not in self._clients), None)
            if free is None:
                wrong = f"the name {name!r} has {PER_NAME} subscriptions; unsubscribe one"
            if wrong or free is None:
                _log.warning("cannot subscribe to a camera: %s", wrong)
                return ""
            self._clients[free] = Client(free, camera, resolution, colour, rate)
            return free

    def remove(self, handle: str) -> bool:
        """Whether there was such a subscription."""
        with self._lock:
            return self._clients.pop(handle, None) is not None

    def remove_all(self, name: str) -> bool:
        """Whether there was any with this name."""
        with self._lock:
            found = [h for h in (f"{name}_{i}" for i in range(PER_NAME)) if self._clients.pop(h, None)]
        return bool(found)

    def find(self, handle: str) -> Client | None:
        """The subscription with a handle."""
        return self._clients.get(handle)

    def handles(self) -> list[str]:
        """All handles."""
        with self._lock:
            return sorted(self._clients)

    def of(self, camera: int) -> list[Client]:
        """The subscriptions to one camera."""
        with self._lock:
            return [client for client in self._clients.values() if client.camera == camera]

    def wait(self, client: Client) -> float:
        """Seconds until the client's next picture is ready, which then is its next one's time too; at its own rate."""
        with self._lock:
            now = self._clock()
            ready = max(now, client.due)
            client.due = ready + 1 / client.rate
            return ready - now


def _wrong(name: object, camera: object, resolution: object, colour: object, rate: object) -> str:
    """What is wrong with a subscription's values, or nothing."""
    if not isinstance(name, str) or not name:
        return f"{name!r} is no name"
    for what, value, known in (("camera", camera, CAMERAS), ("resolution", resolution, SIZES), ("colour space", colour, LAYERS)):
        if value not in known:
            return f"unknown {what} {value!r}; known are {', '.join(map(str, known))}"
    if not isinstance(rate, int) or not 1 <= rate <= FASTEST:
        return f"{rate!r} pictures per second; give 1 to {FASTEST}"
    return ""


def all_dials() -> "dict[int, Dials]":
    """Of all cameras, by their numbers."""
    return {number: Dials() for number in CAMERAS}


class Dials:
    """What one camera is set to."""

    def __init__(self) -> None:
        self._values = cameras.defaults()
        self.exposure = PARAMETERS[cameras.EXPOSURE].default  # of the last picture, as chosen by the automatism

    def settings(self) -> Settings:
        """The present values; a copy."""
        return dict(self._values)

    def get(self, number: int) -> int:
        """The value of a parameter; an automatic one's is what was chosen last."""
        if number == cameras.EXPOSURE and self._values[cameras.AUTO_EXPOSURE]:
            return self.exposure
        return self._values[number]

    def set(self, number: int, value: object) -> bool:
        """Set a parameter; false, and nothing is changed, when it is not known, not to be set now, or out of its range."""
        parameter = PARAMETERS.get(number)
        if parameter is None or not parameter.settable or not isinstance(value, int):
            return False
        need = _NEEDS.get(number)
        if not parameter.least <= value <= parameter.most or (need is not None and self._values[need[0]] != need[1]):
            return False
        self._values[number] = int(value)
        return True

    def reset(self, number: int | None = None) -> bool:
        """Set one parameter, or all, back; false for an unknown one."""
        if number is None:
            self._values = cameras.defaults()
            return True
        if number not in PARAMETERS:
            return False
        self._values[number] = PARAMETERS[number].default
        return True
