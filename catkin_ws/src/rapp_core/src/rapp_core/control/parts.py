"""What the control subsystem works with."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from rapp_core.config import Config
from rapp_core.control.attention import Attention
from rapp_core.control.cloud_agent import CloudAgents
from rapp_core.control.platform import Platform
from rapp_core.launcher.lease import Lease
from rapp_core.ports import Agents, Hop, Robot
from rapp_core.services.executor import Executor
from rapp_core.trace import Trace


@dataclass(frozen=True)
class Parts:
    """All around the states of the core FSM."""

    robot: Robot
    attention: Attention  # the robot's ears
    hop: Hop
    launcher: Agents
    executor: Executor
    platform: Platform
    cloud_agents: CloudAgents
    lease: Lease
    trace: Trace
    config: Config
    stop: threading.Event
    now: Callable[[], float] = time.monotonic
