"""ALMemory: keys and events."""

import logging
import threading
from collections.abc import Callable
from typing import Any

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, quick

_log = logging.getLogger(__name__)
Fetch = Callable[[str], Any]


class Subscriber:
    """What ALMemory.subscriber(key) gives: `signal` fires with each value raised for the key."""

    def __init__(self) -> None:
        self.signal = qi.Signal("(m)")


@qi.multiThreaded()
class ALMemory(Module):
    """The robot's blackboard."""

    def __init__(self, fetch: Fetch) -> None:
        self.__fetch = [fetch]  # in a list: qi would expose a bare callable attribute
        self.__lock = threading.RLock()
        self.__values: dict[str, Any] = {}
        self.__subscribers: dict[str, Subscriber] = {}
        self.__modules: dict[str, dict[str, str]] = {}

    @quick
    def getData(self, key: str) -> Any:  # noqa: N802
        """The value of a key; an error when nobody has set it."""
        with self.__lock:
            if key not in self.__values:
                raise NaoqiError(f"data not found: {key}")
            return self.__values[key]

    def insertData(self, key: str, value: Any) -> None:  # noqa: N802
        """Set a key without telling its subscribers."""
        with self.__lock:
            self.__values[key] = value

    def removeData(self, key: str) -> None:  # noqa: N802
        """Forget a key."""
        with self.__lock:
            self.__values.pop(key, None)

    def getDataListName(self) -> list[str]:  # noqa: N802
        """All keys."""
        with self.__lock:
            return sorted(self.__values)

    def declareEvent(self, key: str, *_extractor: str) -> None:  # noqa: N802
        """Make a key an event."""
        self.subscriber(key)

    def raiseEvent(self, key: str, value: Any) -> None:  # noqa: N802
        """Set a key and tell its subscribers."""
        with self.__lock:
            self.__values[key] = value
            modules = dict(self.__modules.get(key, {}))
        self.subscriber(key).signal(value)
        for module, method in modules.items():
            threading.Thread(target=self.__tell, args=(module, method, key, value), daemon=True).start()

    def raiseMicroEvent(self, key: str, value: Any) -> None:  # noqa: N802
        """As raiseEvent."""
        self.raiseEvent(key, value)

    def subscriber(self, key: str) -> Subscriber:
        """An object whose `signal` fires with each value raised for the key."""
        with self.__lock:
            return self.__subscribers.setdefault(key, Subscriber())

    def subscribeToEvent(self, key: str, module: str, *rest: str) -> None:  # noqa: N802
        """Call `module.method(key, value, "")` at each event; the old form has a message before the method."""
        with self.__lock:
            self.__modules.setdefault(key, {})[module] = rest[-1]

    @quick
    def unsubscribeToEvent(self, key: str, module: str) -> None:  # noqa: N802
        """End subscribeToEvent; an error when there was none."""
        with self.__lock:
            if self.__modules.get(key, {}).pop(module, None) is None:
                raise NaoqiError(f"{module} is not subscribed to {key}")

    def __tell(self, module: str, method: str, key: str, value: Any) -> None:
        try:
            self.__fetch[0](module).call(method, key, value, "")
        except RuntimeError as error:
            _log.warning("cannot tell %s of %s: %s", module, key, error)
