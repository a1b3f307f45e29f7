"""How NAOqi behaves seen from outside: work off the event loop, errors as "Module::method" texts, what every module has."""

import logging
import threading
from collections.abc import Callable
from typing import Any

import qi

_log = logging.getLogger(__name__)
_running = threading.BoundedSemaphore(100)  # calls at work at once; more are refused rather than piled up


class NaoqiError(RuntimeError):
    """A call cannot be done; the client gets the text below the method's name."""


def working(method: Callable[..., Any]) -> Callable[..., Any]:
    """Make a module's method give a future resolved from a thread of its own, so that no thread of libqi ever waits."""

    def call(self: Any, *args: Any) -> Any:
        promise = qi.Promise()
        name = f"{type(self).__name__}::{method.__name__}"
        if not _running.acquire(blocking=False):
            promise.setError(f"{name}\n\ttoo many calls at once")
            return promise.future()
        threading.Thread(target=_work, args=(promise, name, method, self, args), daemon=True, name=name).start()
        return promise.future()

    # Not functools.wraps: libqi would read the wrapped signature and refuse calls that leave out arguments with defaults.
    call.__name__ = method.__name__
    call.__doc__ = method.__doc__
    return call


def _work(promise: Any, name: str, method: Callable[..., Any], module: Any, args: tuple[Any, ...]) -> None:
    try:
        promise.setValue(method(module, *args))
    except NaoqiError as error:
        promise.setError(f"{name}\n\t{error}")
    except TypeError as error:
        promise.setError(f"{name}\n\t{error}")
    except Exception:  # noqa: BLE001 - logged here, and told to the client, who must not wait for ever
        _log.exception("%s failed", name)
        promise.setError(f"{name}\n\tinternal error of the simulator; see its log")
    finally:
        _running.release()


class Module:
    """What every NAOqi module answers (ALModule)."""

    def ping(self) -> bool:
        """True."""
        return True

    def version(self) -> str:
        """Version of NAOqi whose behaviour is simulated."""
        return "2.1.4.13"

    def getBrokerName(self) -> str:  # noqa: N802 - NAOqi's spelling
        """Name of the broker."""
        return "nao_sim"
