"""Cloud agents of four-agent RApps (deliverable section 3.2): `start_cloud_agent`, `stop_cloud_agent`, `list_cloud_agents`.

Their own services are called at `/hop/agents/<agent>/<service>`, see `agent_calls`.
"""

from typing import Any

from rapp_cloud.cloud_agents.agents import CloudAgents
from rapp_cloud.cloud_agents.doors import LONGEST_CALL, MAX_CALL
from rapp_cloud.robots import Robots
from rapp_cloud.services import robot_of
from rapp_hop.errors import Refused
from rapp_hop.hz.text import NAME
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer
from rapp_hop.service import Request, Service, service

PREFIX = "/hop/agents/"


def agent_services(agents: CloudAgents, robots: Robots) -> list[Service]:
    """Make the services."""

    @service(timeout=30)
    async def start_cloud_agent(request: Request, rapp: str, version: str, run: str, robot: str | None = None) -> dict[str, Any]:
        """Start the cloud agent of a RApp for one run; it ends when the robot's lease (seconds) does."""
        name = robot_of(request, robot)
        robots.kind_of(name)
        return {"agent": await agents.start(name, rapp, version, run), "lease": robots.lease}

    @service(timeout=30)
    async def stop_cloud_agent(request: Request, agent: str, robot: str | None = None) -> dict[str, Any]:
        """End a cloud agent of this robot's; returns when nothing of it runs any more."""
        return {"stopped": await agents.stop(robot_of(request, robot), agent)}

    @service
    async def list_cloud_agents(request: Request, robot: str | None = None) -> dict[str, Any]:
        """List this robot's cloud agents."""
        return {"agents": agents.list(robot_of(request, robot))}

    return [start_cloud_agent, stop_cloud_agent, list_cloud_agents]


def agent_calls(agents: CloudAgents) -> Mount:
    """Make `/hop/agents/<agent>/<service>`: only for the robot for which the agent runs, in any form of HOP."""

    async def call(visit: Visit) -> WireAnswer:
        agent, _, name = visit.rest.strip("/").partition("/")
        if not NAME.fullmatch(name):
            raise Refused("cannot call a cloud agent so: its URL is /hop/agents/<agent>/<service>", 404)
        return await agents.send(visit.caller, agent, visit.request, f"/hop/{name}", LONGEST_CALL)

    return Mount(prefix=PREFIX, handler=call, max_body=MAX_CALL)
