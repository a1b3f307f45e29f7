"""The cloud agent of a four-agent RApp, as the core agent sees it (deliverable section 3.2): started, kept, stopped by the link."""

import threading
import time

from rapp_core.config import Config
from rapp_core.errors import CoreError, Refused, Unreachable
from rapp_core.ports import Agent, Hop

KEEP = 2.0  # s between two words to the link that the run lives
STOPPING = 5.0  # s for the link to stop it
TRIES, AGAIN = 10, 1.0  # to stop it, and s between them; later the link and the platform do it by themselves


class CloudAgents:
    """Holds at most one: that of the present run. Nothing here holds up the control subsystem; the link is asked in threads."""

    def __init__(self, hop: Hop, config: Config) -> None:
        self._hop = hop
        self._config = config
        self._lock = threading.Lock()
        self._present: _Partner | None = None

    def begin(self, run: Agent) -> None:
        """Have the run's cloud agent started, when its RApp has one; returns at once."""
        partner = None if run.manifest is None or run.manifest.partner is None else _Partner(self._hop, self._config, run)
        with self._lock:
            self._present = partner
        if partner is not None:
            partner.begin()

    def problem(self) -> CoreError | None:
        """Why it could not be started; None while all is well, or the run has none."""
        partner = self._of(None)
        return None if partner is None else partner.error

    def name_for(self, run: Agent, patience: float) -> str:
        """The name by which the link knows it, once it serves. Raises Refused when the run has none, Unreachable, and its error."""
        partner = self._of(run)
        if partner is None:
            raise Refused("cannot call a cloud agent: the RApp's package.json names no partner")
        partner.wait(patience)
        return run.name

    def stop(self, run: Agent, patience: float) -> bool:
        """Have it stopped; gives whether there was one. Raises CoreError when that is not known within `patience` s."""
        partner = self._of(run)
        return partner is not None and partner.stop(patience)

    def forget(self) -> None:
        """Tell the link that no run lives: what an earlier core agent left, or this one leaves, is stopped."""
        with self._lock:
            partner, self._present = self._present, None
        if partner is not None:
            partner.leave()
        self._hop.keep("")

    def _of(self, run: Agent | None) -> "_Partner | None":
        with self._lock:
            partner = self._present
        return partner if partner is not None and run in (None, partner.run) else None


class _Partner:
    """One cloud agent."""

    def __init__(self, hop: Hop, config: Config, run: Agent) -> None:
        self.run = run
        self.error: CoreError | None = None
        self._hop = hop
        self._config = config
        self._serves = threading.Event()
        self._left = threading.Event()
        self._stopping: threading.Thread | None = None
        self._lock = threading.Lock()
        self._stopped: bool | CoreError = Unreachable("cannot stop the cloud agent: the link has not answered yet")

    def begin(self) -> None:
        """Start it, and keep it, in a thread of its own."""
        threading.Thread(target=self._live, name=f"cloud agent {self.run.name}", daemon=True).start()

    def wait(self, patience: float) -> None:
        """Wait until it serves. Raises what went wrong."""
        if not self._serves.wait(patience):
            raise Unreachable("cannot call the cloud agent: it does not serve yet; try again")
        if self.error is not None:
            raise self.error

    def leave(self) -> None:
        """Say no more that the run lives."""
        self._left.set()

    def stop(self, patience: float) -> bool:
        """See `CloudAgents.stop`; asked again, the same outcome is given, a failed one is tried again."""
        self.leave()
        with self._lock:
            if self._stopping is None or (not self._stopping.is_alive() and isinstance(self._stopped, CoreError)):
                self._stopping = threading.Thread(target=self._stop, name="stop cloud agent", daemon=True)
                self._stopping.start()
            thread = self._stopping
        thread.join(patience)
        if isinstance(self._stopped, CoreError):
            raise self._stopped
        return self._stopped

    def _live(self) -> None:
        manifest, run = self.run.manifest, self.run.name
        assert manifest is not None
        arguments = {"rapp": manifest.name, "version": manifest.version, "run": run}
        try:
            self._hop.request("start_cloud_agent", arguments, self._config.cloud_agent_start)
        except CoreError as error:
            self.error = error
        self._serves.set()
        while not self._left.wait(KEEP):
            self._hop.keep(run)

    def _stop(self) -> None:
        """A link that is away is asked again when nobody waits for it any more, so that the agent does not live on for long."""
        for _ in range(TRIES):
            try:
                answer = self._hop.request("stop_cloud_agent", {"run": self.run.name}, STOPPING)
                self._stopped = isinstance(answer, dict) and bool(answer.get("stopped"))
                return
            except Unreachable as error:
                self._stopped = error
                time.sleep(AGAIN)
            except CoreError as error:
                self._stopped = error
                return
