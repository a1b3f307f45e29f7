"""The persons a robot serves: `profile`, `people`."""

from typing import Any

from rapp_cloud.people import People
from rapp_cloud.services import robot_of
from rapp_hop.service import Request, Service, service


def people_services(known: People) -> list[Service]:
    """Make the services."""

    @service(timeout=10)
    def profile(request: Request, robot: str | None = None, person: str | None = None) -> dict[str, Any]:
        """Return name, language and contacts of the person who is present, or of another whom the robot serves."""
        return known.profile(robot_of(request, robot), person).describe()

    @service(timeout=10)
    def people(request: Request, robot: str | None = None) -> dict[str, Any]:
        """Return whom the robot serves, the one it takes to be present first: account, name and language of each."""
        found = known.of(robot_of(request, robot))
        return {"people": [{"person": one.person, "name": one.profile.name, "language": one.profile.language} for one in found]}

    return [profile, people]
