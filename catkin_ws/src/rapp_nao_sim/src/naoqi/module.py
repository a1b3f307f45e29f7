"""ALModule: an object of this program whose methods the robot can call, by events too."""

import logging
import threading
from collections.abc import Callable
from typing import Any

import qi

from naoqi import sessions

_log = logging.getLogger(__name__)
_SAMPLES = "processRemote"  # gets raw samples of ALAudioDevice, which pass only where bytes are declared


class ALModule:
    """Derive from it and call `ALModule.__init__(self, name)` after an ALBroker was created; raises RuntimeError.

    Every public method of the derived class can be called from the robot: `ALMemory.subscribeToEvent(event, name, method)` makes it
    call `method(event, value, message)`. Calls come in threads of their own.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._broker = sessions.current("ALModule::ALModule")
        try:
            self._number = self._broker.session.registerService(name, _facade(self))
        except RuntimeError as error:
            raise RuntimeError(f"ALModule::ALModule\n\tcannot register {name}: {error}") from error
        self._broker.add(self)

    def getName(self) -> str:  # noqa: N802 - NAOqi's spelling
        """The module's name."""
        return self._name

    def getBrokerName(self) -> str:  # noqa: N802
        """The name of the broker."""
        return self._broker.getName()

    def ping(self) -> bool:
        """True."""
        return True

    def version(self) -> str:
        """Of the module."""
        return "1.0"

    def exit(self) -> None:
        """Take the module away from the robot."""
        self._broker.remove(self)
        self._broker.session.unregisterService(self._number)


def _facade(module: ALModule) -> Any:
    """What libqi gets: the module's public methods and nothing else of it."""
    names = [name for name in dir(type(module)) if not name.startswith("_") and callable(getattr(type(module), name))]
    methods = {name: _remote(module, name) for name in names}
    if _SAMPLES in methods:
        methods[_SAMPLES] = qi.bind(qi.Void, (qi.Int32, qi.Int32, qi.Dynamic, qi.Buffer), _SAMPLES)(methods[_SAMPLES])
    return qi.multiThreaded()(type(module._name, (), methods))()


def _remote(module: ALModule, name: str) -> Callable[..., Any]:
    def call(_facade: Any, *args: Any) -> Any:
        promise = qi.Promise()
        sessions.run(threading.Thread(target=_work, args=(promise, module, name, args), daemon=True, name=name))
        return promise.future()

    call.__name__ = name
    return call


def _work(promise: Any, module: ALModule, name: str, args: tuple[Any, ...]) -> None:
    try:
        promise.setValue(getattr(module, name)(*args))
    except Exception as error:  # noqa: BLE001 - a caller far away must not wait for ever, and the program's author wants to see it
        _log.exception("%s::%s failed", module.getName(), name)
        promise.setError(f"{module.getName()}::{name}\n\t{error}")
