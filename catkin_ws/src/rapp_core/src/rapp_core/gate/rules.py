"""Which names of the robot's ROS one run may use. Pure.

Rules kept here: what is not named is not allowed; names are compared as they are resolved; what a RApp publishes has the core
agent's type, not one that the RApp claims.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

READ = ("status", "feedback", "result")  # topics of an action that its client subscribes to (wiki.ros.org/actionlib)


@dataclass(frozen=True)
class Offered:
    """What the core agent offers to RApps, by relative names."""

    node: str  # resolved name of the core agent's node
    services: frozenset[str]  # each is opened by permissions.core
    always: frozenset[str]  # open to each RApp: the core agent judges call by call
    actions: Mapping[str, str]  # opened by permissions.core too; name to the name of its type in rapp_msgs/action


@dataclass(frozen=True)
class Rules:
    """What one run may use, by resolved names; nothing by default, as before the spare knows its RApp."""

    core: str = ""  # node that publishes and hears the topics
    services: frozenset[str] = frozenset()
    publishes: Mapping[str, str] = field(default_factory=dict)  # topic to its type
    subscribes: frozenset[str] = frozenset()

    def service(self, name: str) -> str:
        """Why this service may not be called; empty when it may."""
        return "" if name in self.services else _refusal("call", name)

    def publish(self, topic: str) -> str:
        """Why nothing may be published here; empty when it may."""
        return "" if topic in self.publishes else _refusal("publish", topic)

    def subscribe(self, topic: str) -> str:
        """Why this topic may not be heard; empty when it may."""
        return "" if topic in self.subscribes else _refusal("subscribe to", topic)

    def as_json(self) -> dict[str, Any]:
        """The rules as they cross to the gate; see `from_json`."""
        sets = {"services": sorted(self.services), "subscribes": sorted(self.subscribes)}
        return {"core": self.core, "publishes": dict(self.publishes), **sets}


def from_json(values: Mapping[str, Any]) -> Rules:
    """The rules that `as_json` gave."""
    return Rules(values["core"], frozenset(values["services"]), dict(values["publishes"]), frozenset(values["subscribes"]))


def rules_for(permitted: Iterable[str], offered: Offered, namespace: str = "") -> Rules:
    """The rules of a RApp whose package.json permits these core services. `namespace`: that of the robot's nodes."""
    allowed = frozenset(permitted)
    prefix = "/".join(["", *namespace.strip("/").split("/"), ""]).replace("//", "/")
    services = frozenset(prefix + name for name in (allowed & offered.services) | offered.always)
    actions = {prefix + name: kind for name, kind in offered.actions.items() if name in allowed}
    publishes = {f"{name}/goal": f"rapp_msgs/{kind}ActionGoal" for name, kind in actions.items()}
    publishes |= {f"{name}/cancel": "actionlib_msgs/GoalID" for name in actions}
    return Rules(offered.node, services, publishes, frozenset(f"{name}/{topic}" for name in actions for topic in READ))


def _refusal(verb: str, name: str) -> str:
    return f"refused: cannot {verb} {name[:200]}: the RApp's package.json does not name it under permissions.core"
