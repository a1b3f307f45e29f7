"""ALProxy: calls a module of the robot as if it were here."""

import itertools
from typing import Any

from naoqi.sessions import connect, current

_SLICE = 100  # ms; Ctrl-C is heard between two

_Future = Any


class ALProxy:
    """`proxy.method(...)` waits for the method's end; `proxy.post.method(...)` gives a number for wait, isRunning and stop.

    `ALProxy(name, ip, port)`, or `ALProxy(name)` for the robot of this program's ALBroker. Raises RuntimeError.
    """

    def __init__(self, name: str, ip: str | None = None, port: int = 9559) -> None:
        try:
            session = current("ALProxy::ALProxy").session if ip is None else connect(ip, port)
            self._module = session.service(name)
        except RuntimeError as error:
            text = str(error)
            raise RuntimeError(text if "::" in text.split("\n")[0] else f"ALProxy::ALProxy\n\tcannot use {name}: {text}") from error
        self._name = name
        self._posted: dict[int, _Future] = {}
        self._numbers = itertools.count(1)
        self.post = _Post(self)

    def __getattr__(self, method: str) -> Any:
        if method.startswith("_"):
            raise AttributeError(method)
        return lambda *args: self.call(method, *args)

    def call(self, method: str, *args: Any) -> Any:
        """Call a method by its name and wait for its end."""
        return _result(self._begin(method, args))

    def pCall(self, method: str, *args: Any) -> int:  # noqa: N802 - NAOqi's spelling
        """Call a method by its name without waiting; gives the number of the call."""
        number = next(self._numbers)
        self._posted = {known: future for known, future in self._posted.items() if future.isRunning()}
        self._posted[number] = self._begin(method, args)
        return number

    def wait(self, number: int, timeout: int) -> bool:
        """Wait for the end of a posted call, at most `timeout` ms (0: for ever); gives whether the time was over first."""
        future = self._posted.get(number)
        left = timeout
        while future is not None and future.isRunning() and (timeout == 0 or left > 0):
            future.wait(_SLICE if timeout == 0 else min(_SLICE, left))
            left -= _SLICE
        return future is not None and bool(future.isRunning())

    def isRunning(self, number: int) -> bool:  # noqa: N802
        """Whether a posted call has not ended."""
        future = self._posted.get(number)
        return future is not None and bool(future.isRunning())

    def stop(self, number: int) -> None:
        """Ask a posted call to end; what cannot be stopped in its midst goes on."""
        future = self._posted.get(number)
        if future is not None:
            future.cancel()

    def _begin(self, method: str, args: tuple[Any, ...]) -> _Future:
        try:
            return getattr(self._module, method)(*args, _async=True)
        except AttributeError as error:
            raise RuntimeError(f"{self._name}::{method}\n\tcannot find method {method}") from error


class _Post:
    """The asynchronous side of a proxy."""

    def __init__(self, proxy: ALProxy) -> None:
        self._proxy = proxy

    def __getattr__(self, method: str) -> Any:
        if method.startswith("_"):
            raise AttributeError(method)
        return lambda *args: self._proxy.pCall(method, *args)


def _result(future: _Future) -> Any:
    while future.isRunning():
        future.wait(_SLICE)
    value = future.value()
    return list(value) if isinstance(value, tuple) else value
