"""The service that `bench hop` calls."""

from typing import Any

from rapp_hop.service import service


@service(concurrency=64)
async def echo(value: Any) -> Any:
    """Say it again."""
    return value
