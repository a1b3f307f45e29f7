"""The services that `bench hop` calls."""

import time
from typing import Any

from rapp_hop.service import service

BURN = 0.002  # s


@service(concurrency=64)
async def echo(value: Any) -> Any:
    """Say it again."""
    return value


@service(concurrency=64)
async def burn(value: Any) -> Any:
    """Say it again after some work on the loop, as no service should: what one process then cannot, several can."""
    end = time.thread_time() + BURN
    while time.thread_time() < end:
        pass
    return value
