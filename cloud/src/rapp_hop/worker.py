"""One worker process, as `workers` starts it: `python -m rapp_hop.worker FD`, an inherited end of a socket pair.

First comes (import path, module, function, its arguments): the function makes the object. Then come (method, arguments), and
(true, result) or (false, exception) go back, until the other end is gone.
"""

import importlib
import pickle
import signal
import sys
from multiprocessing.connection import Connection


def main() -> None:
    """Serve until the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends its workers
    pipe = Connection(int(sys.argv[1]))
    try:
        path, module, function, arguments = pipe.recv()
        sys.path[:] = path
        subject = getattr(importlib.import_module(module), function)(*arguments)
        while True:
            method, given = pipe.recv()
            try:
                answer = (True, getattr(subject, method)(*given))
            except Exception as error:  # noqa: BLE001 (carried to the caller, who knows its type)
                answer = (False, error)
            _send(pipe, answer)
    except (EOFError, ConnectionError):
        return


def _send(pipe: Connection, answer: tuple[bool, object]) -> None:
    try:
        pipe.send(answer)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        pipe.send((False, TypeError(f"cannot pass on the worker's answer: {error}")))


if __name__ == "__main__":
    main()
