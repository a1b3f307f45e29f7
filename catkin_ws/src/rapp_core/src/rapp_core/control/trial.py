"""The first start of a new version of a RApp: the version before stays until this one has started (DESIGN section 3.4).

A version is on trial while the link keeps the one before beside it (`previous`). It has started once it has said its first
word and has come through its `initialise`. It has not when it fails, dies or hangs before that; what the platform or the
robot is to blame for says nothing of it.
"""

import contextlib
import logging
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rapp_core.errors import CoreError
from rapp_core.ports import Hop
from rapp_core.trace import Trace

ANSWERED = 5.0  # s for the link to drop the version before, or to go back to it
_log = logging.getLogger(__name__)


class Trial:
    """Watches one start after the other, and tells the link of those that matter to it."""

    def __init__(self, hop: Hop, trace: Trace) -> None:
        self._hop = hop
        self._trace = trace
        self._package = Path()
        self.why = ""
        """How the RApp itself has failed; empty while it has not."""
        self._initialising = False

    def begin(self, package: Path) -> None:
        """An installed package, `.../<name>/<version>`, is about to be started; the link sees when it was used last."""
        with contextlib.suppress(OSError):
            os.utime(package)
        self._package, self.why, self._initialising = package, "", False

    @property
    def name(self) -> str:
        """Of the RApp."""
        return self._package.parent.name

    @property
    def version(self) -> str:
        """That was started."""
        return self._package.name

    def told(self, message: Mapping[str, Any]) -> None:
        """What has passed over the dynamic agent's channel; its s2 is its `initialise`, its s3 what it is there for (Fig. 3)."""
        self._trace.of_dynamic(message)
        if (message["type"], message.get("machine"), message.get("kind")) == ("state", "dynamic", "entered"):
            self._initialising = message.get("state") == "s2" or (self._initialising and message.get("state") != "s3")

    def failed(self, why: str) -> None:
        """The RApp itself has failed."""
        self.why = self.why or why

    def end(self, run: str, spoken: bool) -> str | None:
        """The run is over; `spoken`: it has said its first word. Gives what to say when the version before is back."""
        name, version = self.name, self.version
        ok = spoken and not self._initialising
        if not (ok or self.why) or not self._on_trial() or not self._hop.present:
            return None
        arguments = {"run": run, "name": name, "version": version, "ok": ok, "detail": "" if ok else self.why}
        try:
            before = self._hop.request("started", arguments, ANSWERED).get("back")
        except CoreError as error:
            _log.warning("%s; the link is told after its next start", error)
            return None
        if before is None:
            return None
        self._trace.note(f"{name} {version} did not start ({self.why}), {before} is back")
        return "The new version did not start, the one before is back"

    def _on_trial(self) -> bool:
        links = self._package.parent
        return (links / "previous").is_symlink() and (links / "current").resolve() == self._package
