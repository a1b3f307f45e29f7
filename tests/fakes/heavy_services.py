"""Services for worker processes."""

import os
import time
from typing import Any

from rapp_hop.errors import Refused
from rapp_hop.service import Request, service


@service(heavy=True, concurrency=2, timeout=60)
def spin(until: str, request: Request) -> dict[str, Any]:
    """Hold a core until a file is there."""
    while not os.path.exists(until):  # noqa: PTH110 (as little as can be)
        pass
    return {"pid": os.getpid(), "caller": request.caller}


@service(heavy=True, concurrency=1)
def pid() -> int:
    return os.getpid()


@service(heavy=True, concurrency=1)
def refuse() -> None:
    raise Refused("cannot do this: ask for something else", 403)


@service(heavy=True, concurrency=1)
def unsendable() -> Any:
    return lambda: None


@service(heavy=True, concurrency=1)
def die() -> None:
    os._exit(3)


@service(heavy=True, concurrency=1, timeout=0.5)
def hang() -> None:
    time.sleep(600)
