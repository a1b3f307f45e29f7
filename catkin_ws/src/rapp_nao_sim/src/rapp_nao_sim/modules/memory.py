"""ALMemory: keys and events."""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Mapping
from typing import Any, Protocol

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, quick, working

_log = logging.getLogger(__name__)
Fetch = Callable[[str], Any]


class Source(Protocol):
    """Keys that are read fresh."""

    def names(self) -> Collection[str]:
        """The keys."""
        ...

    def read(self) -> Mapping[str, Any]:
        """All of them with their values."""
        ...


class _Nothing:
    def names(self) -> Collection[str]:
        return ()

    def read(self) -> Mapping[str, Any]:
        return {}


class Subscriber:
    """What ALMemory.subscriber(key) gives: `signal` fires with each value raised for the key."""

    def __init__(self) -> None:
        self.signal = qi.Signal("(m)")


@qi.multiThreaded()
class ALMemory(Module):
    """The robot's blackboard."""

    def __init__(self, fetch: Fetch, source: Source | None = None) -> None:
        self.__fetch = [fetch]  # in a list: qi would expose a bare callable attribute
        self.__source: list[Source] = [source or _Nothing()]
        self.__lock = threading.RLock()
        self.__values: dict[str, Any] = {}
        self.__set_at: dict[str, float] = {}  # when each key of `values` was set
        self.__subscribers: dict[str, Subscriber] = {}
        self.__modules: dict[str, dict[str, str]] = {}
        self.__news: dict[str, deque[tuple[str, str, Any]]] = {}  # what is to be told to modules, while a thread tells it

    @working
    def getData(self, key: str) -> Any:  # noqa: N802
        """The value of a key; an error when nobody has set it."""
        return self.__look(key)[0]

    @working
    def getTimestamp(self, key: str) -> list[Any]:  # noqa: N802
        """[value, s, us]: a key with the time when it was set; a key of the body is read now. An error when nobody has set it."""
        value, when = self.__look(key)
        return [value, int(when), int(when % 1 * 1e6)]

    @quick
    def getType(self, key: str) -> str:  # noqa: N802
        """What a key is: "Event", as getEventList has it, or "Data"; an error when nobody has set it."""
        with self.__lock:
            if key in self.__subscribers:
                return "Event"
            if key in self.__values or key in self.__source[0].names():
                return "Data"
        raise NaoqiError(f"data not found: {key}")

    def __look(self, key: str) -> tuple[Any, float]:
        source = self.__source[0]
        if key in source.names():
            return source.read()[key], time.time()
        with self.__lock:
            if key not in self.__values:
                raise NaoqiError(f"data not found: {key}")
            return self.__values[key], self.__set_at[key]

    @working
    def getListData(self, keys: list[str]) -> list[Any]:  # noqa: N802
        """The values of keys at one moment; None for one that nobody has set."""
        source = self.__source[0]
        fresh = source.read() if any(key in source.names() for key in keys) else {}
        with self.__lock:
            return [fresh.get(key, self.__values.get(key)) for key in keys]

    def insertListData(self, pairs: list[tuple[str, Any]]) -> None:  # noqa: N802
        """Set keys without telling their subscribers."""
        for key, value in pairs:
            self.insertData(key, value)

    def insertData(self, key: str, value: Any) -> None:  # noqa: N802
        """Set a key without telling its subscribers."""
        with self.__lock:
            self.__values[key], self.__set_at[key] = value, time.time()

    def removeData(self, key: str) -> None:  # noqa: N802
        """Forget a key."""
        with self.__lock:
            self.__values.pop(key, None)
            self.__set_at.pop(key, None)

    def getDataListName(self) -> list[str]:  # noqa: N802
        """All keys."""
        with self.__lock:
            return sorted({*self.__values, *self.__source[0].names()})

    def getDataList(self, part: str) -> list[str]:  # noqa: N802
        """The keys that contain a text."""
        return [key for key in self.getDataListName() if part in key]

    def getEventList(self) -> list[str]:  # noqa: N802
        """The keys that are events."""
        with self.__lock:
            return sorted(self.__subscribers)

    def declareEvent(self, key: str, *_extractor: str) -> None:  # noqa: N802
        """Make a key an event."""
        self.subscriber(key)

    def raiseEvent(self, key: str, value: Any) -> None:  # noqa: N802
        """Set a key and tell its subscribers."""
        with self.__lock:
            self.__values[key], self.__set_at[key] = value, time.time()
            modules = dict(self.__modules.get(key, {}))
        self.subscriber(key).signal(value)
        for module, method in modules.items():
            self.__queue(module, (method, key, value))

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

    def getSubscribers(self, key: str) -> list[str]:  # noqa: N802
        """The modules that subscribeToEvent was called for; who listens to a `subscriber` is not known by name."""
        with self.__lock:
            return sorted(self.__modules.get(key, {}))

    def __queue(self, module: str, news: tuple[str, str, Any]) -> None:
        """Have a module told, after all that it is still to be told."""
        with self.__lock:
            waiting = self.__news.get(module)
            if waiting is not None:
                waiting.append(news)
                return
            self.__news[module] = deque([news])
        threading.Thread(target=self.__tell, args=(module,), daemon=True, name=f"news for {module}").start()

    def __tell(self, module: str) -> None:
        while True:
            with self.__lock:
                if not self.__news[module]:
                    del self.__news[module]
                    return
                method, key, value = self.__news[module].popleft()
            try:
                self.__fetch[0](module).call(method, key, value, "")
            except RuntimeError as error:
                _log.warning("cannot tell %s of %s: %s", module, key, error)
