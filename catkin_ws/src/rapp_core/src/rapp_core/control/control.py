"""What the states of the core FSM do; s10 is in `dismantling`."""

import logging
from pathlib import Path

from rapp_agent import Subsystem
from rapp_core.control.dismantling import Dismantling
from rapp_core.control.late_news import LateNews
from rapp_core.control.listening import Listener
from rapp_core.control.parts import Parts
from rapp_core.control.quarantine import Quarantine
from rapp_core.control.question import which
from rapp_core.control.refusals import not_activated, not_installed, not_interpreted, not_started
from rapp_core.control.stopping import Stopping
from rapp_core.control.trial import Trial
from rapp_core.control.words import NONE_OF_THEM, NOT_UNDERSTOOD, READY, READY_ALONE, STOPPED, UNUSABLE
from rapp_core.errors import Bug, CoreError, Invalid, Refused, Unreachable
from rapp_core.ports import Agent

_log = logging.getLogger(__name__)
STEP = 0.05  # s between two looks at the dynamic agent
RETRY = 1.0  # s between tries to reach the robot
OTHERS = (f"{Unreachable.__name__}:", f"{Bug.__name__}:")  # so begins what a RApp tells of a failure that is others' fault


class Control:
    """Transition functions and terminal conditions of the core FSM (see `fsm.Acts`)."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._listener = Listener(parts.robot, parts.config, parts.now)
        self._recording = parts.config.home / "listening" / "command.ogg"
        self._trial = Trial(parts.hop, parts.trace)
        self._quarantine = Quarantine(parts.config)
        self._stopping = Stopping(parts.robot, parts.attention, parts.trace)
        self._dismantling = Dismantling(parts, self._stopping, self._trial, self._quarantine)
        self._late_news = LateNews(parts.hop, self._say)
        self._run: Agent | None = None

    # s1, s2: initialise, register

    def initialise(self, share: Subsystem) -> None:
        """Reach the robot, stop whatever moves or sounds, warm a spare."""
        parts = self._parts
        self._recording.parent.mkdir(parents=True, exist_ok=True)
        parts.launcher.prepare()
        share.memory["ready"] = self._dismantling.still()
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
        """One listening round; first, what the person has to be told of what went on after a run."""
        parts, known = self._parts, self._parts.platform.changes
        self._stopping.end()
        self._late_news.tell()
        share.memory.update(keyword=None, command=None, choice=None, problem=None, rapp=None, error=None)
        keywords = {keyword: known.name for known in parts.platform.rapps().values() for keyword in known.keywords}

        def stale() -> bool:
            return parts.platform.changes != known or self._late_news.waits

        heard = self._listener.round(sorted(keywords), self._recording, parts.stop, stale)
        if isinstance(heard, Path):
            share.memory["command"] = heard
        elif heard is not None:
            parts.trace.heard(heard)
            share.memory.update(keyword=heard, rapp=keywords[heard])
        if heard is not None:
            self._stopping.begin()

    def heard(self, share: Subsystem) -> bool:
        """Whether a keyword or a long command was heard."""
        return share.memory["keyword"] is not None or share.memory["command"] is not None

    def keyword(self, share: Subsystem) -> None:
        """The core agent itself knows which RApp an isolated keyword means."""
        self._parts.trace.note(f"keyword {share.memory['keyword']} means {share.memory['rapp']}")
        self._heed_stop(share)

    def long_command(self, share: Subsystem) -> None:
        """The platform interprets a long command; the core agent has only recorded it."""
        parts = self._parts
        arguments = {"recording": str(share.memory["command"]), "language": parts.config.language}
        try:
            answer = parts.hop.request("interpret", arguments, parts.config.interpret_timeout, self._stopping.given)
        except CoreError as error:
            self._problem(share, not_interpreted(error), error)
            self._heed_stop(share)
            return
        if answer.get("text"):
            parts.trace.heard(str(answer["text"]))
        share.memory.update(rapp=answer.get("rapp"), choice=answer.get("choice"))
        if answer.get("rapp") is None and not answer.get("choice"):
            share.memory["problem"] = NOT_UNDERSTOOD
        self._heed_stop(share)

    def ask_which(self, share: Subsystem) -> None:
        """Ask which of several RApps is meant, listen for the answer as long as rapp_recognize does, and take it."""
        executor, choice = self._parts.executor, share.memory["choice"]
        assert isinstance(choice, list)
        asked = which(map(str, choice), self._parts.platform.rapps())
        try:
            executor.run("rapp_say", call=self._stopping.call, text=asked.text, language="en")
            answers = list(asked.answers)
            word = executor.run("rapp_recognize", call=self._stopping.call, dictionary=answers, timeout=0.0)["word"]
        except Refused:
            if not self._stopping.given():
                raise
            word = None
        share.memory["rapp"] = asked.answers.get(word)
        if share.memory["rapp"] is None:
            share.memory["problem"] = NONE_OF_THEM if word in asked.answers else NOT_UNDERSTOOD
        self._heed_stop(share)

    def download(self, share: Subsystem) -> None:
        """Have the link download, verify and install the RApp, unless it is here already, or is not to be started now."""
        parts, name = self._parts, str(share.memory["rapp"])
        here = parts.platform.runnable(name)
        if here is not None:
            parts.trace.note(f"{name} {here.version} is installed")
            share.memory["package"] = here.path
        else:
            self._install(share, name)
        if share.memory["problem"] is None:
            package = Path(str(share.memory["package"]))
            share.memory["problem"] = self._quarantine.refusal(package.parent.name, package.name)
        self._heed_stop(share)

    def _install(self, share: Subsystem, name: str) -> None:
        parts = self._parts
        try:
            answer = parts.hop.request("install", {"name": name}, parts.config.install_timeout, self._stopping.given)
            share.memory["package"] = Path(answer["path"])
        except CoreError as error:
            known = parts.platform.rapps().get(name)
            broken = isinstance(error, Invalid) and not error.reason  # a reason names an attack, or a revoked key
            if (broken or isinstance(error, Unreachable | Refused)) and known is not None and known.path is not None:
                _log.warning("%s; %s %s runs", error, name, known.version)
                share.memory["package"] = known.path
                if broken and not self._stopping.given():
                    self._say(UNUSABLE)
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
            self._problem(share, not_activated(error), error)
            if isinstance(error, Invalid):
                self._blame(str(error))
                self._judge(share, None)
            self._heed_stop(share)
            return
        parts.lease.grant(self._run)
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
            self._blame(run.outcome[1] if run.outcome is not None else "no first word")
            share.memory["problem"] = "It did not start"
        self._look_at_cloud_agent(share)
        self._heed_stop(share)

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
                self._blame(problem)
                share.memory["problem"] = problem
            self._heed_stop(share)

    def _blame(self, why: str) -> None:
        """The RApp has failed; what fails once the person has stopped it is nobody's fault."""
        if not self._stopping.given():
            self._trial.failed(why)

    def _heed_stop(self, share: Subsystem) -> None:
        """What the person has stopped has no other problem."""
        if self._stopping.given():
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
            if self._parts.cloud_agents.problem() is None and not outcome[1].startswith(OTHERS):
                self._blame(outcome[1])
        self._look_at_cloud_agent(share)
        return outcome is not None or share.memory["problem"] is not None or self._parts.stop.is_set()

    # s10, s11: destroy, apologise

    def destroy(self, share: Subsystem) -> None:
        """See `dismantling`."""
        run = self._present()
        self._dismantling.destroy(run)
        self._run = None
        self._parts.launcher.prepare()
        if share.memory.get("problem") is None:
            self._heed_stop(share)
        self._judge(share, run)

    def _judge(self, share: Subsystem, run: Agent | None) -> None:
        share.memory["problem"] = self._dismantling.judge(run) or share.memory.get("problem")

    def apologise(self, share: Subsystem) -> None:
        """Say aloud what failed; a state that raised an error comes here too."""
        error = share.memory.get("error")
        if isinstance(error, Unreachable):
            _log.warning("%s", error)
        elif isinstance(error, Exception):
            _log.error("state failed", exc_info=error)
        if self._run is not None:
            self.destroy(share)
        self._stopping.end()
        if not self._say(str(share.memory.get("problem") or "Something went wrong")):
            self._parts.stop.wait(RETRY)

    def close(self) -> None:
        """Stop the robot, end a run that still lives, let the robot rest."""
        self._dismantling.close(self._run)
        self._run = None

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
