"""All that a RApp imports on the robot: what the robot and the cloud can do, DynamicAgent, FSMs; `testing` is for the desk."""

from rapp_agent import Behaviour, Edge, Machine, Subsystem
from rapp_api import cloud, communication, keepsakes, navigation, vision
from rapp_api.dynamic_agent import DynamicAgent
from rapp_api.errors import Bug, Invalid, RappError, Refused, Unreachable
from rapp_api.poses import Pose

__all__ = [
    "Behaviour",
    "Bug",
    "DynamicAgent",
    "Edge",
    "Invalid",
    "Machine",
    "Pose",
    "RappError",
    "Refused",
    "Subsystem",
    "Unreachable",
    "cloud",
    "communication",
    "keepsakes",
    "navigation",
    "vision",
]
