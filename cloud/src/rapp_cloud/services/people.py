"""The robot's user: `profile`."""

from typing import Any

from rapp_cloud.profiles import Profiles
from rapp_cloud.services import robot_of
from rapp_hop.service import Request, Service, service


def people_services(profiles: Profiles) -> list[Service]:
    """Make the services."""

    @service(timeout=10)
    def profile(request: Request, robot: str | None = None) -> dict[str, Any]:
        """Return name, language and contacts of the robot's user."""
        return profiles.get(robot_of(request, robot)).describe()

    return [profile]
