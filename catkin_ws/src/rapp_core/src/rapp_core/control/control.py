"""What the states of the core FSM do."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rapp_agent import Subsystem
from rapp_core.body_ports import Movement
from rapp_core.config import Config
from rapp_core.control.cloud_agent import CloudAgents
from rapp_core.control.listening import Listener
from rapp_core.control.platform import Platform
from rapp_core.control.question import which
from rapp_core.control.refusals import not_installed, not_interpreted, not_started
from rapp_core.control.touch import Touch
from rapp_core.control.trial import Trial
from rapp_core.control.words import NONE_OF_THEM, NOT_UNDERSTOOD, READY, READY_ALONE, STOPPED
from rapp_core.errors import CoreError, Invalid, Refused, Unreachable
from rapp_core.launcher.lease import Lease
from rapp_core.ports import Agent, Agents, Hop, Robot
from rapp_core.services.executor import Executor
from rapp_core.trace import Trace

_log = logging.getLogger(__name__)
STEP = 0.05  # s between two looks at the dynamic agent
HURRIED = 0.2  # s for a dynamic agent that did not end by itself to stop what it has started
RESTING = 0.3  # s in which the robot is seen to begin to rest before the core agent leaves it
RETRY = 1.0  # s between tries to reach the robot


@dataclass(frozen=True)
class Parts:
    """What the control subsystem works with."""

    robot: Robot
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


class Control:
    """Transition functions and terminal conditions of the core FSM (see `fsm.Acts`)."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._listener = Listener(parts.robot, parts.config, parts.now)
        self._recording = parts.config.home / "listening" / "command.ogg"
        self._trial = Trial(parts.hop, parts.trace)
        self._touch = Touch(parts.robot.feeling)
        self._run: Agent | None = None

    # s1, s2: initialise, register

    def initialise(self, share: Subsystem) -> None:
        """Reach the robot, stop whatever moves or sounds, warm a spare."""
        parts = self._parts
        self._recording.parent.mkdir(parents=True, exist_ok=True)
        parts.launcher.prepare()
        share.memory["ready"] = self._still()
        if not share.memory["ready"]:
            parts.stop.wait(RETRY)

    def initialised(self, share: Subsystem) -> bool:
        """Whether the robot has answered."""
        return bool(share.memory["ready"])

    def register(self, _share: Subsystem) -> None:
        """Register with the repository agent, and say that the robot is ready."""
        registered = self._parts.platform.register()
        self._parts.cloud_agents.forget()
        self._say(READY if registered else READY_ALONE)

    # s3 to s6: from a command to a package

    def listen(self, share: Subsystem) -> None:
        """One listening round."""
        parts, known = self._parts, self._parts.platform.changes
        share.memory.update(keyword=None, command=None, choice=None, problem=None, rapp=None, error=None)
        keywords = {keyword: known.name for known in parts.platform.rapps().values() for keyword in known.keywords}
        heard = self._listener.round(sorted(keywords), self._recording, parts.stop, lambda: parts.platform.changes != known)
        if isinstance(heard, Path):
            share.memory["command"] = heard
        elif heard is not None:
            parts.trace.heard(heard)
            share.memory.update(keyword=heard, rapp=keywords[heard])

    def heard(self, share: Subsystem) -> bool:
        """Whether a keyword or a long command was heard."""
        return share.memory["keyword"] is not None or share.memory["command"] is not None

    def keyword(self, share: Subsystem) -> None:
        """The core agent itself knows which RApp an isolated keyword means."""
        self._parts.trace.note(f"keyword {share.memory['keyword']} means {share.memory['rapp']}")

    def long_command(self, share: Subsystem) -> None:
        """The platform interprets a long command; the core agent has only recorded it."""
        parts = self._parts
        arguments = {"recording": str(share.memory["command"]), "language": parts.config.language}
        try:
            answer = parts.hop.request("interpret", arguments, parts.config.interpret_timeout)
        except CoreError as error:
            self._problem(share, not_interpreted(error), error)
            return
        if answer.get("text"):
            parts.trace.heard(str(answer["text"]))
        share.memory.update(rapp=answer.get("rapp"), choice=answer.get("choice"))
        if answer.get("rapp") is None and not answer.get("choice"):
            share.memory["problem"] = NOT_UNDERSTOOD

    def ask_which(self, share: Subsystem) -> None:
        """Ask which of several RApps is meant, listen for the answer as long as rapp_recognize does, and take it."""
        executor, choice = self._parts.executor, share.memory["choice"]
        assert isinstance(choice, list)
        asked = which(map(str, choice), self._parts.platform.rapps())
        executor.run("rapp_say", text=asked.text, language="en")
        word = executor.run("rapp_recognize", dictionary=list(asked.answers), timeout=0.0)["word"]
        share.memory["rapp"] = asked.answers.get(word)
        if share.memory["rapp"] is None:
            share.memory["problem"] = NONE_OF_THEM if word in asked.answers else NOT_UNDERSTOOD

    def download(self, share: Subsystem) -> None:
        """Have the link download, verify and install the RApp, unless it is here already."""
        parts, name = self._parts, str(share.memory["rapp"])
        here = parts.platform.runnable(name)
        if here is not None:
            parts.trace.note(f"{name} {here.version} is installed")
            share.memory["package"] = here.path
            return
        try:
            answer = parts.hop.request("install", {"name": name}, parts.config.install_timeout)
            share.memory["package"] = Path(answer["path"])
        except CoreError as error:
            known = parts.platform.rapps().get(name)
            if isinstance(error, Unreachable | Refused) and known is not None and known.path is not None:
                _log.warning("%s; %s %s runs", error, name, known.version)
                share.memory["package"] = known.path
            else:
                self._problem(share, not_installed(name, error), error)

    # s7 to s9: the dynamic agent lives

    def activate(self, share: Subsystem) -> None:
        """Start the dynamic agent and give it the lease; its cloud agent, if it has one, is started beside it."""
        parts, package = self._parts, Path(str(share.memory["package"]))
        self._trial.begin(package)
        try:
            self._run = parts.launcher.activate(package, self._trial.told)
        except CoreError as error:
            self._problem(share, "I cannot start it", error)
            if isinstance(error, Invalid):
                self._trial.failed(str(error))
                self._end_trial(share)
            return
        parts.lease.grant(self._run)
        self._touch.begin()
        parts.cloud_agents.begin(self._run)
        share.memory["until"] = parts.now() + parts.config.first_word

    def await_first_word(self, share: Subsystem) -> None:
        """Wait for the dynamic agent's first word over its channel."""
        run = self._present()
        if run.first_word.wait(STEP):
            return
        late = self._parts.now() > float(str(share.memory["until"]))
        if late or self._parts.stop.is_set() or self._parts.lease.problem(True) is not None or run.outcome is not None:
            _log.warning("run %s: no first word: %s", run.name, run.outcome or "dead, silent or late")
            self._trial.failed(run.outcome[1] if run.outcome is not None else "no first word")
            share.memory["problem"] = "It did not start"
        self._look_at_cloud_agent(share)
        self._heed_touch(share)

    def first_word_or_over(self, share: Subsystem) -> bool:
        """Whether it has spoken, or never will."""
        return self._present().first_word.is_set() or share.memory["problem"] is not None

    def serve(self, share: Subsystem) -> None:
        """Core services run in their callers' threads; here the lease is watched."""
        run = self._present()
        self._parts.stop.wait(STEP)
        if run.outcome is None:
            problem = self._parts.lease.problem(self._parts.executor.busy)
            if problem is not None:
                _log.warning("run %s: %s", run.name, problem)
                self._trial.failed(problem)
                share.memory["problem"] = problem
            self._heed_touch(share)

    def _heed_touch(self, share: Subsystem) -> None:
        if self._touch.felt:
            share.memory["problem"] = STOPPED

    def _look_at_cloud_agent(self, share: Subsystem) -> None:
        error = self._parts.cloud_agents.problem()
        if error is not None:
            self._problem(share, not_started(error), error)

    def over(self, share: Subsystem) -> bool:
        """Whether the dynamic agent has finished, failed, died, or gone silent."""
        outcome = self._present().outcome
        if outcome is not None and outcome[0] != "done":
            share.memory["problem"] = "It has failed"
            _log.warning("the dynamic agent failed: %s", outcome[1])
            if self._parts.cloud_agents.problem() is None:
                self._trial.failed(outcome[1])
        self._look_at_cloud_agent(share)
        return outcome is not None or share.memory["problem"] is not None or self._parts.stop.is_set()

    # s10, s11: destroy, apologise

    def destroy(self, share: Subsystem) -> None:
        """Dismantle in the order of DESIGN section 3.5, kill, release the lease, warm the next spare.

        The robot is stopped before anything that takes time; a run that has not come to its end by itself is not waited for.
        """
        run, parts = self._present(), self._parts
        if run.outcome is None:
            parts.lease.release()
            self._still()
        if run.alive:
            parts.trace.send("core", "dynamic", "dismantle")
            run.dismantle(parts.config.dismantle if run.outcome is not None else HURRIED, parts.stop)
        self._stop_cloud_agent(run)
        parts.lease.release()
        self._still()
        parts.executor.put_back()
        self._close_senses()
        self._end_run()
        parts.launcher.prepare()
        self._end_trial(share, run)

    def _end_trial(self, share: Subsystem, run: Agent | None = None) -> None:
        """A version that did not start has given way to the one before, unless the robot is ending."""
        if not self._parts.stop.is_set():
            words = self._trial.end(run.name if run else "", bool(run and run.first_word.is_set()))
            share.memory["problem"] = words or share.memory.get("problem")

    def _stop_cloud_agent(self, run: Agent) -> None:
        """The dynamic agent has stopped its cloud agent; if it could not, the core agent does, before it ends the dynamic one."""
        try:
            self._parts.cloud_agents.stop(run, self._parts.config.cloud_agent_stop / 3)
        except CoreError as error:
            _log.warning("%s; the platform stops it with the robot's lease", error)

    def _end_run(self) -> None:
        self._touch.end()
        run, parts = self._present(), self._parts
        keep = parts.launcher.log_of(run.manifest) if run.manifest is not None else None
        run.end(parts.config.terminate, keep)
        self._run = None
        parts.trace.note("dynamic agent destroyed")

    def _still(self) -> bool:
        """Stop all motion and sound; gives False when the robot is away."""
        robot, reached = self._parts.robot, True
        for stop in (robot.motion.stop, robot.player.stop, robot.voice.hush):
            try:
                stop()
            except Refused as error:
                _log.info("%s", error)
            except CoreError as error:
                _log.warning("%s", error)
                reached = False
        return reached

    def apologise(self, share: Subsystem) -> None:
        """Say aloud what failed; a state that raised an error comes here too."""
        error = share.memory.get("error")
        if isinstance(error, Unreachable):
            _log.warning("%s", error)
        elif isinstance(error, Exception):
            _log.error("state failed", exc_info=error)
        if self._run is not None:
            self.destroy(share)
        if not self._say(str(share.memory.get("problem") or "Something went wrong")):
            self._parts.stop.wait(RETRY)

    def close(self) -> None:
        """Stop the robot, end a run that still lives, let the robot rest."""
        self._parts.lease.release()
        reached = self._still()
        self._parts.cloud_agents.forget()
        if self._run is not None:
            self._end_run()
        resting = self._let_rest() if reached else None
        if resting is not None:
            resting.wait(RESTING)

    def _let_rest(self) -> Movement | None:
        """Release the body; the robot goes on by itself."""
        try:
            return self._parts.robot.motion.release()
        except CoreError as error:
            _log.warning("%s", error)
            return None
        finally:
            self._close_senses()

    def _close_senses(self) -> None:
        """Let what the robot sees and feels for us be idle."""
        self._parts.robot.camera.close()
        self._parts.robot.feeling.close()

    def _present(self) -> Agent:
        assert self._run is not None
        return self._run

    def _problem(self, share: Subsystem, words: str, error: CoreError) -> None:
        _log.warning("%s: %s", words, error)
        share.memory["problem"] = words

    def _say(self, text: str) -> bool:
        try:
            self._parts.executor.run("rapp_say", text=text, language="en")
        except CoreError as error:
            _log.warning("%s", error)
            return False
        return True
