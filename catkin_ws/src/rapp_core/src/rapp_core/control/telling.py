"""What the core agent tells of its messages to and from the link."""

from collections.abc import Mapping
from typing import Any

from rapp_core.trace import Trace

UNTOLD = frozenset({"list_rapps", "report", "mail_told"})
"""Asked every minute, whether something happens or not; said of a run that is over."""
SUBJECTS = {"install": "name", "remove": "name", "started": "name", "start_cloud_agent": "rapp", "call": "service"}
"""Argument that says what a request is about."""
ANSWERS = {"interpret": "rapp", "send_mail": "state"}  # field that says how a request was answered


class Telling:
    """One request to the link."""

    def __init__(self, trace: Trace, name: str, arguments: Mapping[str, Any]) -> None:
        """Take a service rapp_hop/<name> and its arguments."""
        self._trace = trace
        self._told = name not in UNTOLD
        self._name = name
        self._what = f"{name} {arguments[SUBJECTS[name]]}" if name in SUBJECTS else name

    def asked(self) -> None:
        """The core agent asks, and waits for the end of the job."""
        if self._told:
            self._trace.call("core", "link", self._what)

    def progress(self, phase: str) -> None:
        """The link tells how far it is."""
        if self._told:
            self._trace.send("link", "core", phase)

    def answered(self, result: Any) -> Any:
        """The link has done it; gives the result."""
        field = ANSWERS.get(self._name)
        how = f": {result.get(field)}" if field is not None and isinstance(result, dict) else ""
        if self._told:
            self._trace.reply("link", "core", self._what + how)
        return result

    def failed(self, error: str) -> None:
        """The link could not do it; `error` is the wire word."""
        if self._told:
            self._trace.reply("link", "core", f"{self._what}: {error}")

    def cut(self) -> None:
        """The core agent does not wait for the end of the job any more, and has it cancelled."""
        if self._told:
            self._trace.send("core", "link", f"cancel {self._what}")
