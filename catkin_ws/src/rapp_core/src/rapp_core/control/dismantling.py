"""State s10: ends a run, and all that it has started on the robot and at the platform (DESIGN section 3.5)."""

import logging
import threading

from rapp_core.body_ports import Movement
from rapp_core.control.parts import Parts
from rapp_core.control.quarantine import Quarantine
from rapp_core.control.stopping import Stopping
from rapp_core.control.trial import Trial
from rapp_core.errors import CoreError, Refused
from rapp_core.ports import Agent

HURRIED = 0.2  # s for a dynamic agent that did not end by itself to stop what it has started
RESTING = 0.3  # s in which the robot is seen to begin to rest before the core agent leaves it

_log = logging.getLogger(__name__)


class Dismantling:
    """Takes a run apart, judges its start, and leaves the robot still."""

    def __init__(self, parts: Parts, stopping: Stopping, trial: Trial, quarantine: Quarantine) -> None:
        self._parts = parts
        self._stopping = stopping
        self._trial = trial
        self._quarantine = quarantine

    def destroy(self, run: Agent) -> None:
        """Dismantle in the order of DESIGN section 3.5, kill, release the lease.

        The robot is stopped before anything that takes time; a run that has not come to its end by itself, or that the person
        stops meanwhile, is not waited for.
        """
        parts = self._parts
        if run.outcome is None:
            parts.lease.release()
            self.still()
        if run.alive:
            parts.trace.send("core", "dynamic", "dismantle")
            run.dismantle(parts.config.dismantle if run.outcome is not None else HURRIED, _Either(parts.stop, self._stopping))
        if self._stopping.given():
            parts.lease.release()
            self.still()
        self._stop_cloud_agent(run)
        parts.lease.release()
        self.still()
        parts.executor.put_back()
        self._close_senses()
        self.end(run)

    def judge(self, run: Agent | None) -> str | None:
        """Whose fault it is, unless the robot is ending; gives what to say when the version before is back.

        A version that did not start has given way to the one before; one that fails again and again is not started for a while.
        A run that the person has stopped says nothing of it.
        """
        if self._parts.stop.is_set():
            return None
        trial = self._trial
        if trial.why:
            self._quarantine.failed(trial.name, trial.version, trial.why)
        elif not self._stopping.given() and run is not None and run.outcome is not None and run.outcome[:1] == ("done",):
            try:
                self._quarantine.forget(trial.name)
            except OSError as error:
                _log.warning("cannot keep that %s has come to its end: %s", trial.name, error)
        return trial.end(run.name if run else "", bool(run and run.first_word.is_set()))

    def _stop_cloud_agent(self, run: Agent) -> None:
        """The dynamic agent has stopped its cloud agent; if it could not, the core agent does, before it ends the dynamic one."""
        try:
            self._parts.cloud_agents.stop(run, self._parts.config.cloud_agent_stop / 3)
        except CoreError as error:
            _log.warning("%s; the platform stops it with the robot's lease", error)

    def end(self, run: Agent) -> None:
        """End its processes; what it printed is kept."""
        parts = self._parts
        keep = parts.launcher.log_of(run.manifest) if run.manifest is not None else None
        run.end(parts.config.terminate, keep)
        self._stopping.end()
        parts.trace.note("dynamic agent destroyed")

    def still(self) -> bool:
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

    def close(self, run: Agent | None) -> None:
        """The core agent ends: stop the robot, end a run that still lives, let the robot rest."""
        parts = self._parts
        parts.lease.release()
        reached = self.still()
        self._stopping.end()
        parts.cloud_agents.forget()
        if run is not None:
            self.end(run)
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


class _Either:
    """A `ports.Signal`: the core agent is to end, or the person stops the robot."""

    def __init__(self, stop: threading.Event, stopping: Stopping) -> None:
        self._stop = stop
        self._stopping = stopping

    def is_set(self) -> bool:
        return self._stop.is_set() or self._stopping.given()

    def wait(self, timeout: float) -> bool:
        self._stop.wait(timeout)
        return self.is_set()
