"""The embodied agent of deliverable D2.2.2, section 2: subsystems with buffers, behaviours, and FSMs of behaviours.

Pure: standard library only, no I/O, no threads, no clock. Whoever owns the thread steps the machine.
"""

from rapp_agent.behaviour import Behaviour, Edge, always
from rapp_agent.buffers import Buffer
from rapp_agent.draw import to_dot, to_mermaid
from rapp_agent.errors import AgentError, BufferFull, GraphError
from rapp_agent.events import Event
from rapp_agent.machine import Machine
from rapp_agent.subsystem import Subsystem

__all__ = [
    "AgentError",
    "Behaviour",
    "Buffer",
    "BufferFull",
    "Edge",
    "Event",
    "GraphError",
    "Machine",
    "Subsystem",
    "always",
    "to_dot",
    "to_mermaid",
]
