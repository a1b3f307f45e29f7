"""All that a RApp imports on the robot: communication, cloud, DynamicAgent; and `testing`, a core agent for the author's desk."""

from rapp_api import cloud, communication
from rapp_api.dynamic_agent import DynamicAgent
from rapp_api.errors import Bug, Invalid, RappError, Refused, Unreachable

__all__ = ["Bug", "DynamicAgent", "Invalid", "RappError", "Refused", "Unreachable", "cloud", "communication"]
