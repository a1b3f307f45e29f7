"""A core agent for a RApp author's tests: no robot, no ROS, a person who answers from a list.

with FakeCoreAgent(hears=["Elizabeth"], services={"profile": {...}}) as core:
    VoiceMail().run()
assert ("say", "sending e-mail") in core.calls
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rapp_api.core_agent import use
from rapp_api.errors import RappError, Refused

Service = Any | Callable[[dict[str, Any]], Any]


class FakeCoreAgent:
    """Implements `CoreAgent` in memory and notes every call in `calls` as (name, argument)."""

    def __init__(
        self,
        hears: Sequence[str] = (),
        services: Mapping[str, Service] | None = None,
        mail: str | RappError = "delivered",
    ) -> None:
        self.calls: list[tuple[str, Any]] = []
        self.mails: list[dict[str, Any]] = []
        self._hears = list(hears)
        self._services = dict(services or {})
        self._mail = mail
        self._end: Callable[[], None] | None = None

    def __enter__(self) -> "FakeCoreAgent":
        self._end = use(self)
        return self

    def __exit__(self, *_exception: object) -> None:
        if self._end is not None:
            self._end()

    def said(self) -> list[str]:
        """All texts that were said."""
        return [argument for name, argument in self.calls if name == "say"]

    def say(self, text: str, language: str) -> None:
        """Note the text."""
        self.calls.append(("say", text))

    def recognize(self, dictionary: Sequence[str], timeout: float) -> str:
        """The person's next word when it is in the dictionary, else "Empty"."""
        self.calls.append(("recognize", list(dictionary)))
        word = self._hears.pop(0) if self._hears else ""
        return next((known for known in dictionary if known.lower() == word.lower()), "Empty")

    def record(self, duration: float) -> str:
        """A path."""
        self.calls.append(("record", duration))
        return "/recordings/recording.ogg"

    def record_until_silence(self, path: str, waiting_time: float, microphone_energy: int) -> str:
        """A path."""
        self.calls.append(("record_until_silence", (path, waiting_time, microphone_energy)))
        return f"/recordings/{path or 'recording.ogg'}"

    def play_audio(self, path: str, position: float, volume: float, balance: float, loop: bool) -> None:
        """Note the path."""
        self.calls.append(("play_audio", path))

    def cloud_call(self, service: str, arguments: dict[str, Any], timeout: float) -> Any:
        """What `services` says; an error there is raised."""
        self.calls.append(("cloud_call", service))
        if service not in self._services:
            raise Refused(f"cannot call {service}: it is not among this test's services")
        answer = self._services[service]
        if isinstance(answer, RappError):
            raise answer
        return answer(arguments) if callable(answer) else answer

    def send_mail(self, recipients: Sequence[str], subject: str, body: str, attachment: str) -> str:
        """Note the mail; answer what `mail` says."""
        self.calls.append(("send_mail", list(recipients)))
        self.mails.append({"recipients": list(recipients), "subject": subject, "body": body, "attachment": attachment})
        if isinstance(self._mail, RappError):
            raise self._mail
        return self._mail
