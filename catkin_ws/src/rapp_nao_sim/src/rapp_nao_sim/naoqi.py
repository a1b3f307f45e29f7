"""How NAOqi behaves seen from outside: work off the event loop, errors as "Module::method" texts, what every module has."""

import inspect
import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import qi

from rapp_nao_sim.errors import SimError
from rapp_nao_sim.world.errors import WorldError

_log = logging.getLogger(__name__)
_running = threading.BoundedSemaphore(100)  # calls at work at once; more are refused rather than piled up
# What a client is told in its own words; arguments of a wrong type are among it.
_TOLD = (SimError, WorldError, TypeError, ValueError)
# What ends a call under way when its client cancels it: a method of the same module.
_ENDED_BY = {
    "ALMotion::moveTo": "stopMove",
    "ALMotion::angleInterpolation": "killAll",
    "ALMotion::angleInterpolationWithSpeed": "killAll",
    "ALRobotPosture::goToPosture": "stopMove",
    "ALRobotPosture::applyPosture": "stopMove",
}


class NaoqiError(SimError):
    """A call cannot be done; the client gets the text below the method's name."""


def working(method: Callable[..., Any]) -> Callable[..., Any]:
    """Make a module's method give a future resolved from a thread of its own, so that no thread of libqi ever waits."""

    def call(self: Any, *args: Any) -> Any:
        name = _name(self, method)
        promise = qi.Promise(lambda _promise: _end(self, name))
        if not _running.acquire(blocking=False):
            promise.setError(f"{name}\n\ttoo many calls at once")
            return promise.future()
        threading.Thread(target=_work, args=(promise, name, method, self, args), daemon=True, name=name).start()
        return promise.future()

    return named(call, method)


def quick(method: Callable[..., Any]) -> Callable[..., Any]:
    """Make the errors of a module's method that returns at once arrive as NAOqi's: without Python's traceback."""

    def call(self: Any, *args: Any) -> Any:
        try:
            return method(self, *args)
        except _TOLD as error:
            promise = qi.Promise()
            promise.setError(_text(_name(self, method), error))
            return promise.future()

    return named(call, method)


def promised(name: str, future: "Future[Any]") -> Any:
    """libqi's future of a call `name` that ends, without a value, when a future of ours does."""
    promise = qi.Promise()

    def tell(done: "Future[Any]") -> None:
        error = done.exception()
        if error is None:
            promise.setValue(None)
        else:
            promise.setError(_text(name, error))

    future.add_done_callback(tell)
    return promise.future()


def _end(module: Any, name: str) -> None:
    """End a call that its client cancels, where that is possible; it then gives what it gives when it is stopped."""
    if name in _ENDED_BY:
        getattr(module, _ENDED_BY[name])()


def _work(promise: Any, name: str, method: Callable[..., Any], module: Any, args: tuple[Any, ...]) -> None:
    try:
        promise.setValue(method(module, *args))
    except Exception as error:  # noqa: BLE001 - told to the client, who must not wait for ever
        promise.setError(_text(name, error))
    finally:
        _running.release()


def _text(name: str, error: BaseException) -> str:
    if isinstance(error, _TOLD):
        return f"{name}\n\t{error}"
    _log.error("%s failed", name, exc_info=error)
    return f"{name}\n\tinternal error of the simulator; see its log"


def _name(module: Any, method: Callable[..., Any]) -> str:
    return f"{type(module).__name__}::{method.__name__}"


def named(call: Callable[..., Any], method: Callable[..., Any]) -> Callable[..., Any]:
    """Make what stands for a module's method known as it: by its name, and to the help that a module gives of itself."""
    # Not functools.wraps: libqi would read the wrapped signature and refuse calls that leave out arguments with defaults.
    call.__name__ = method.__name__
    call.__doc__ = method.__doc__
    call.method = method  # type: ignore[attr-defined]
    return call


def _original(call: Callable[..., Any]) -> Callable[..., Any]:
    """The method as it was written, below what stands for it."""
    while hasattr(call, "method"):
        call = call.method
    return call


class Module:
    """What every NAOqi module answers (ALModule).

    There is no wait, isRunning or stop: they take the number that `post` gives for a call, which the client's proxy keeps.
    """

    def ping(self) -> bool:
        """True."""
        return True

    def version(self) -> str:
        """Version of NAOqi whose behaviour is simulated."""
        return "2.1.4.13"

    def getBrokerName(self) -> str:  # noqa: N802 - NAOqi's spelling
        """Name of the broker."""
        return "nao_sim"

    def getMethodList(self) -> list[str]:  # noqa: N802
        """Names of the methods."""
        return [name for name in dir(type(self)) if not name.startswith("_") and callable(getattr(type(self), name))]

    def getModuleHelp(self) -> list[Any]:  # noqa: N802
        """What the module is for, and a list of examples, which is empty."""
        return [inspect.getdoc(type(self)), []]

    @quick
    def getMethodHelp(self, name: str) -> list[Any]:  # noqa: N802
        """A method's name, what it does, [name, type] of each parameter, an empty name and the type of what it returns."""
        return self.__help(name)

    @quick
    def getUsage(self, name: str) -> str:  # noqa: N802
        """How a method is called, and what it does, as one text."""
        _, does, parameters, _, gives = self.__help(name)
        return f"{name}({', '.join(f'{part}: {kind}' for part, kind in parameters)}) -> {gives}\n{does}"

    def __help(self, name: str) -> list[Any]:
        if name not in self.getMethodList():
            raise NaoqiError(f"cannot find method {name!r}; getMethodList tells all")
        method = _original(getattr(type(self), name))
        signature = inspect.signature(method)
        parts = list(signature.parameters.values())[1:]  # without self
        parameters = [[str(part).partition(":")[0].lstrip("_"), inspect.formatannotation(part.annotation)] for part in parts]
        return [name, inspect.getdoc(method) or "", parameters, "", inspect.formatannotation(signature.return_annotation)]
