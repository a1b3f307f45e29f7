"""What became of RApps on robots: `report`, `runs`."""

from typing import Any

from rapp_cloud.accounts import Accounts
from rapp_cloud.audit import Audit
from rapp_cloud.reports import MAX_REPORT, Reports
from rapp_cloud.services import robot_of
from rapp_hop.errors import Invalid
from rapp_hop.service import Request, Service, service

MOST = 200  # reports of one answer


def run_services(reports: Reports, audit: Audit, accounts: Accounts) -> list[Service]:
    """Make the services."""

    @service(timeout=10, max_body=MAX_REPORT)
    def report(request: Request, run: dict[str, Any], robot: str | None = None) -> dict[str, Any]:
        """Keep the report of a run; the same run again replaces it."""
        name = robot_of(request, robot)
        kept, new = reports.keep(name, run)
        if new:
            words = {key: str(run[key])[:200] for key in ("version", "outcome") if key in run}
            audit.note(name, "run", str(run.get("rapp", ""))[:100], run=kept, **words)
        return {"kept": True}

    @service(timeout=10)
    def runs(request: Request, robot: str | None = None, most: int = 50) -> dict[str, Any]:
        """List the newest runs: a robot's own; of one robot or of all of them for whoever may read."""
        if not 0 < most <= MOST:
            raise Invalid(f"cannot list {most} runs: ask for 1 to {MOST}")
        whose = robot if accounts.may(request.caller, "read") else robot_of(request, robot)
        return {"runs": reports.of(whose, most)}

    return [report, runs]
