"""A core agent in memory: its FSM and control, and everything around them a fake."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from fakes.agents import FakeAgents
from fakes.clock import Clock
from fakes.link import FakeLink
from fakes.rapps import write_rapp
from fakes.robot import FakeRobot
from rapp_agent import Subsystem
from rapp_core.config import Config
from rapp_core.control.attention import Attention, OwnVoice
from rapp_core.control.cloud_agent import CloudAgents
from rapp_core.control.control import Control
from rapp_core.control.fsm import core_machine
from rapp_core.control.parts import Parts
from rapp_core.control.platform import Platform
from rapp_core.launcher.lease import Lease
from rapp_core.services.context import Context
from rapp_core.services.executor import Executor
from rapp_core.trace import Happening, Trace

KEYWORD = ["s3", "s4", "s6", "s7", "s8", "s9", "s10", "s3"]
LONG = ["s3", "s5", "s6", "s7", "s8", "s9", "s10", "s3"]
BROKEN = ["s3", "s4", "s6", "s7", "s8", "s9", "s10", "s11", "s3"]
QUESTION = "Do you mean clock or alarm clock?"


class Home:
    """A core agent in a flat where everything is a fake."""

    def __init__(self, folder: Path) -> None:
        self.clock = Clock()
        self.fake = FakeRobot(self.clock)
        self.config = Config(home=folder / "home", heartbeat=1.0, hang=10.0, first_word=15.0)
        package = write_rapp(folder / "store" / "clock", "clock", keywords=("what time is it",))
        catalogue = [{"name": "clock", "version": "1.0.0", "keywords": {"en": ["what time is it"]}}]
        self.link = FakeLink({"clock": package}, catalogue)
        self.agents = FakeAgents(self.clock, folder / "home", self.fake.journal)
        self.trace = Trace()
        self.happenings: list[Happening] = []
        self.trace.listen(self.happenings.append)
        self.lease = Lease(self.config, self.clock.now)
        self.stop = self.clock.event()
        listening = folder / "listening"
        voice = OwnVoice(self.fake.robot.voice, self.config, self.clock.now)
        attention = Attention(self.fake.robot.ears, "stop", self.config, voice, self.fake.body.clock.now)
        robot = replace(self.fake.robot, voice=voice, ears=attention)
        context = Context(robot, self.config, self.trace, listening, cut=self.stop, now=self.clock.now)
        self.executor = Executor(context)
        self.platform = Platform(self.link, self.config)
        self.cloud_agents = CloudAgents(self.link, self.config)
        parts = Parts(
            robot, attention, self.link, self.agents, self.executor, self.platform, self.cloud_agents, self.lease,
            self.trace, self.config, self.stop, self.clock.now,
        )  # fmt: skip
        self.control = Control(parts)
        self.machine = core_machine(self.control)
        self.machine.listen(self.trace.core_event)
        self.share = Subsystem("core", memory={"problem": None})

    def step_until(self, done: Callable[[], bool], steps: int = 5000) -> None:
        for _ in range(steps):
            if done():
                return
            self.machine.step(self.share)
        raise AssertionError(f"still in {self.machine.state} after {steps} steps: {self.states()}")

    def start(self) -> None:
        """Come to s3 for the first time; nothing that happened before counts."""
        self.step_until(lambda: self.machine.state == "s3")
        self.happenings.clear()
        self.fake.journal.clear()
        self.happenings.append(Happening("core", "core", "s3", "entered", "listen"))

    def round(self) -> list[str]:
        """From s3 once around to s3; gives the states."""
        self.step_until(lambda: len(self.states()) > 1 and self.machine.state == "s3")
        return self.states()

    def states(self) -> list[str]:
        return [each.state for each in self.happenings if each.kind == "entered" and each.machine == "core"]

    def messages(self) -> list[str]:
        return [each.detail for each in self.happenings if each.kind == "message"]


def ask(home: Home, text: str = "what time is it", seconds: float = 1.0, **more: Any) -> None:
    home.fake.person_says_at(home.clock.time + 1.0, text, seconds=seconds, **more)


def failing_round(home: Home) -> tuple[list[str], list[str]]:
    """Once around; gives the states, and what was said."""
    states = home.round()
    return states, home.fake.said()


def ask_what_fits_two(home: Home, answer: str | None) -> None:
    """Say a sentence that the platform takes for either of two RApps, then perhaps answer the robot's question."""
    home.link.catalogue.append({"name": "alarm_clock", "version": "1.0.0", "keywords": {"en": ["wake me"]}})
    home.link.shelf["alarm_clock"] = write_rapp(home.config.home.parent / "store" / "alarm_clock", "alarm_clock")
    home.link.answers["interpret"] = {"rapp": None, "confidence": 0.8, "text": "the clock", "choice": ["clock", "alarm_clock"]}
    home.start()
    ask(home, "something with the clock please", seconds=2.5, probability=0.1)
    home.step_until(lambda: home.machine.state == "s12")
    if answer is not None:
        home.fake.person_says_at(home.clock.time + 3.0, answer)
