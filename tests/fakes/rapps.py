"""RApps made for one test."""

import json
from pathlib import Path
from typing import Any

from fakes.cloud_agents import write_cloud_agent

AGENT = """from rapp_api import DynamicAgent, cloud, communication


class Agent(DynamicAgent):
    def execute(self) -> None:
{body}
"""

JAVASCRIPT = """const rapp = require("rapp_api");
const {{ cloud, communication, navigation, vision, keepsakes }} = rapp;

module.exports = class Agent extends rapp.DynamicAgent {{
  async execute() {{
{body}
  }}
}};
"""


def write_rapp(
    folder: Path, name: str, body: str = "pass", keywords: tuple[str, ...] = (), version: str = "1.0.0", **rapp: Any
) -> Path:
    """A package whose dynamic agent executes `body`; gives its folder."""
    folder.mkdir(parents=True)
    entry, program = _program(rapp.get("runtime", "python3"), body)
    manifest = {
        "name": name,
        "version": version,
        "description": "made for a test",
        "rapp": {
            "agent": "dynamic",
            "entry": entry,
            "runtime": "python3",
            "keywords": {"en": list(keywords or (name,))},
            "sentences": {"en": [f"please run {name}"]},
            "permissions": {"core": ["rapp_say"], "cloud": []},
            "partner": None,
            "needs": {"robot": ["nao"], "api": ">=1.0"},
            **rapp,
        },
    }
    (folder / "package.json").write_text(json.dumps(manifest))
    (folder / entry).write_text(program)
    return folder


def _program(runtime: str, body: str) -> tuple[str, str]:
    """Name and text of the file of a dynamic agent that executes `body`."""
    if runtime == "javascript":
        return "agent.js", JAVASCRIPT.format(body=body)
    return "agent.py", AGENT.format(body="\n".join(f"        {line}" for line in body.splitlines()))


def install_rapp(home: Path, name: str, body: str = "pass", **rapp: Any) -> Path:
    """A RApp in the place where the link installs them."""
    folder = write_rapp(home / "rapps" / name / "1.0.0", name, body, **rapp)
    (folder.parent / "current").symlink_to("1.0.0")
    return folder


def write_four_agent_rapp(folder: Path, name: str, body: str, program: str, cloud: tuple[str, ...] = (), **rapp: Any) -> list[Path]:
    """The two packages of a four-agent RApp, the cloud agent's first.

    `program` is its cloud agent's, which may call the platform's services `cloud`.
    """
    return [
        write_cloud_agent(folder / name / "cloud", f"{name}_cloud", program, permissions={"core": [], "cloud": list(cloud)}),
        write_rapp(folder / name / "dynamic", name, body, partner=f"{name}_cloud", **rapp),
    ]
