"""The session with NAOqi: every call is bounded, errors are translated once, a lost session is opened anew."""

import os
import threading
from typing import Any

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi logs on stdout otherwise; read when it is loaded

import qi

from rapp_core.errors import Bug, Refused, Unreachable

CONNECT_TIMEOUT = 3.0  # s


class Connection:
    """One robot's NAOqi. Services are fetched anew after the session was lost: old proxies stay dead."""

    def __init__(self, url: str, timeout: float) -> None:
        self.url = url
        self._timeout = timeout
        self._lock = threading.RLock()
        self._session: Any = None
        self._services: dict[str, Any] = {}

    def open(self) -> None:
        """Connect; no effect when connected. Raises Unreachable."""
        with self._lock:
            if self._session is not None and self._session.isConnected():
                return
            self._services.clear()
            session = qi.Session()
            try:
                session.connect(self.url, _async=True).value(round(CONNECT_TIMEOUT * 1000))
            except (RuntimeError, ValueError) as error:
                session.close()
                raise Unreachable(f"cannot reach NAOqi at {self.url}: {error}; is the robot on?") from error
            self._session = session

    @property
    def present(self) -> bool:
        """Whether the session is open at this moment."""
        session = self._session
        return session is not None and bool(session.isConnected())

    def close(self) -> None:
        """Leave the robot."""
        with self._lock:
            if self._session is not None:
                self._session.close()
                self._session = None
                self._services.clear()

    def service(self, module: str) -> Any:
        """A module of NAOqi. Raises Unreachable, Refused when the robot has no such module."""
        with self._lock:
            self.open()
            if module not in self._services:
                try:
                    fetched = self._session.service(module, _async=True)
                    self._services[module] = fetched.value(round(self._timeout * 1000))
                except RuntimeError as error:
                    if "Cannot find service" in str(error):
                        raise Refused(f"cannot use {module}: this robot does not have it") from error
                    raise self._translated(module, "service", str(error), self._timeout) from error
            return self._services[module]

    def call(self, module: str, method: str, *args: Any, timeout: float | None = None) -> Any:
        """Call a method and wait for its result, at most `timeout` s. Raises Unreachable, Refused, Bug."""
        future = self.start(module, method, *args)
        return self.result(future, module, method, timeout)

    def result(self, future: Any, module: str, method: str, timeout: float | None = None) -> Any:
        """What a call that was started gives, waited for at most `timeout` s. Raises Unreachable, Refused, Bug."""
        limit = self._timeout if timeout is None else timeout
        try:
            return future.value(round(limit * 1000))
        except RuntimeError as error:
            raise self._translated(module, method, str(error), limit) from error

    def start(self, module: str, method: str, *args: Any) -> Any:
        """Call a method asynchronously; gives libqi's future. Raises Unreachable, Refused, Bug."""
        proxy = self.service(module)
        try:
            return getattr(proxy, method)(*args, _async=True)
        except AttributeError as error:
            raise Refused(f"cannot use {module}.{method}: this robot does not have it") from error
        except RuntimeError as error:
            raise self._translated(module, method, str(error), self._timeout) from error

    def _translated(self, module: str, method: str, text: str, limit: float) -> Exception:
        if text.startswith("Future timeout"):
            return Unreachable(f"cannot wait for {module}.{method}: no answer in {limit:g} s; is the robot overloaded?")
        if not self.present or any(sign in text for sign in ("Session closed", "Socket is not connected")):
            return Unreachable(f"cannot reach NAOqi at {self.url}: the session was lost during {module}.{method}")
        if "At:" in text or "did not match" in text:  # a traceback of the module's program, or a call it does not know
            return Bug(f"cannot {method}: {module} answered: {text}")
        return Refused(f"cannot {method}: {text.splitlines()[-1].strip()}")
