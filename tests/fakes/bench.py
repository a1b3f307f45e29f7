"""An executor of core services with everything around it in memory, and a dynamic agent that calls."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fakes.agents import FakeAgent, Script
from fakes.clock import Clock
from fakes.rapps import write_rapp
from fakes.robot import FakeRobot
from rapp_core.config import Config
from rapp_core.launcher.lease import Grant
from rapp_core.manifest import read_manifest
from rapp_core.services.calls import Call
from rapp_core.services.context import Context
from rapp_core.services.executor import Executor
from rapp_core.trace import Happening, Trace


class Bench:
    """What goes on after a reply waits in `aside` until the test lets it."""

    def __init__(self, folder: Path, **config: Any) -> None:
        self.clock = Clock()
        self.fake = FakeRobot(self.clock)
        self.trace = Trace()
        self.happenings: list[Happening] = []
        self.trace.listen(self.happenings.append)
        settings = Config(home=folder, threshold=0.4, recognise_timeout=8.0, **config)
        self.context = Context(self.fake.robot, settings, self.trace, folder / "listening", now=self.clock.now)
        self.aside: list[Callable[[], None]] = []
        self.executor = Executor(self.context, self.aside.append)
        package = write_rapp(folder / "run" / "package", "probe")
        self.agent = FakeAgent(self.clock, folder / "run", read_manifest(package), Script(terminate=None), [], lambda _m: None)
        self.cut = self.clock.event()

    def call(self, name: str, /, **request: Any) -> dict[str, Any]:
        return self.executor.run_for(Grant(self.agent, self.cut), name, **request)

    def goal(self, name: str, call: Call, /, **request: Any) -> dict[str, Any]:
        """As an action's goal: it is told how far it is, and ends what is in its way."""
        return self.executor.run_for(Grant(self.agent, self.cut), name, call=call, preempt=True, **request)

    def go_on(self) -> None:
        """Let what goes on after replies come to its end."""
        while self.aside:
            self.aside.pop(0)()

    def messages(self) -> list[str]:
        return [each.detail for each in self.happenings if each.kind == "message"]

    def states(self) -> list[str]:
        return [each.state for each in self.happenings if each.kind == "entered"]
