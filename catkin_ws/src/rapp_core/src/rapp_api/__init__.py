"""All that a RApp imports on the robot: communication, cloud, DynamicAgent and FSMs; `testing` is a core agent for the desk."""

from rapp_agent import Behaviour, Edge, Machine, Subsystem
from rapp_api import cloud, communication
from rapp_api.dynamic_agent import DynamicAgent
from rapp_api.errors import Bug, Invalid, RappError, Refused, Unreachable

__all__ = [
    "Behaviour",
    "Bug",
    "DynamicAgent",
    "Edge",
    "Invalid",
    "Machine",
    "RappError",
    "Refused",
    "Subsystem",
    "Unreachable",
    "cloud",
    "communication",
]
