"""What became of a RApp on a robot: `report`."""

from typing import Any

from rapp_cloud.audit import Audit
from rapp_cloud.reports import Reports
from rapp_cloud.services import robot_of
from rapp_hop.service import Request, Service, service


def run_services(reports: Reports, audit: Audit) -> list[Service]:
    """Make the services."""

    @service(timeout=10, max_body=256 * 1024)
    def report(request: Request, run: dict[str, Any], robot: str | None = None) -> dict[str, Any]:
        """Keep the report of a run; the same run again replaces it."""
        name = robot_of(request, robot)
        kept = reports.keep(name, run)
        words = {key: str(run[key])[:200] for key in ("version", "outcome") if key in run}
        audit.note(name, "run", str(run.get("rapp", ""))[:100], run=kept, **words)
        return {"kept": True}

    return [report]
