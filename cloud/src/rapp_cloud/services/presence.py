"""Being here: `register`, `heartbeat`, `list_rapps` (paper §III: the robot registers, then sees the RApps it can use)."""

from typing import Any

from rapp_cloud.catalogue import RobotKind
from rapp_cloud.robots import Robots
from rapp_cloud.services import robot_of
from rapp_cloud.views import Views
from rapp_hop.hz.semver import check_api
from rapp_hop.hz.text import check_name
from rapp_hop.service import Request, Service, service


def presence_services(robots: Robots, views: Views) -> list[Service]:
    """Make the services."""

    @service
    async def register(request: Request, kind: str, api_version: str, robot: str | None = None) -> dict[str, Any]:
        """Say what a robot is; it is here until its lease (seconds) ends without a heartbeat."""
        name = robot_of(request, robot)
        robots.register(name, RobotKind(check_name(kind), check_api(api_version)))
        return {"registered": True, "lease": robots.lease}

    @service
    async def heartbeat(request: Request, robot: str | None = None) -> dict[str, Any]:
        """Renew the lease; registered is false when there is none, register again then."""
        return {"registered": robots.heartbeat(robot_of(request, robot)), "lease": robots.lease}

    @service(timeout=10)
    def list_rapps(request: Request, robot: str | None = None) -> dict[str, Any]:
        """List the RApps of the store, compatible ones and others with the reasons."""
        kind = robots.kind_of(robot_of(request, robot))
        return {"rapps": views.described(kind)}

    return [register, heartbeat, list_rapps]
