"""The platform's HOP services, one module per family; each module has one function that makes its services."""

from rapp_hop.errors import Refused
from rapp_hop.service import Request


def robot_of(request: Request, robot: str | None) -> str:
    """Return the robot that the token names.

    :raises Refused: when the body names another one
    """
    if robot is not None and robot != request.caller:
        raise Refused(f"cannot act for {robot[:70]!r}: the token is another robot's")
    return request.caller
