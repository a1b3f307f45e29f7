"""A core agent for a RApp author's tests: no robot, no ROS, a person who answers from a list.

with FakeCoreAgent(hears=["Elizabeth"], services={"profile": {...}}, package=Path("store/voice_mail")) as core:
    VoiceMail().run()
assert ("say", "sending e-mail") in core.calls
"""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rapp_api.core_agent import use
from rapp_api.errors import Invalid, RappError, Refused
from rapp_api.fake_body import FakeBody, Image

Service = Any | Callable[[dict[str, Any]], Any]
RECORDINGS = "/recordings"
KEEPSAKES = "/keepsakes"
KEPT_FILE = 8 << 20  # bytes of one kept file
LANGUAGES = ("en", "pl", "fr", "de", "es", "it", "el", "pt", "nl", "sv", "da", "fi", "cs", "ru", "tr", "ja", "ko", "zh", "ar")
"""What a NAO may speak; which of them one robot does, depends on its voices."""


class FakeCoreAgent(FakeBody):
    """Implements `CoreAgent` in memory, with the real one's limits, and notes every call in `calls` as (name, argument).

    `hears` are the words the person says, one for each time the robot listens ("" for silence); `services` gives for each HOP
    service its result, a function of its arguments (files are `Path`), or the RappError it ends with; `agent_services` does so for
    the RApp's own cloud agent; `mail` is what `send_mail_wait` gives or a RappError; `pictures` are what the cameras see, one
    after another; `walks` says how each walk ends (None: well); with `package`, the folder of the RApp, calls that its package.json
    does not name are refused.
    """

    def __init__(
        self,
        hears: Sequence[str] = (),
        services: Mapping[str, Service] | None = None,
        mail: str | RappError = "delivered",
        package: Path | None = None,
        pictures: Sequence[Image] = (),
        walks: Sequence[RappError | None] = (),
        agent_services: Mapping[str, Service] | None = None,
    ) -> None:
        super().__init__(pictures, walks)
        self.calls: list[tuple[str, Any]] = []
        self.mails: list[dict[str, Any]] = []
        self.recordings: list[str] = []
        self.kept: dict[str, bytes] = {}
        self.parameters: dict[str, Any] = {}
        self._hears = list(hears)
        self._services = dict(services or {})
        self._agent_services = dict(agent_services or {})
        self._partner = agent_services is not None
        self._mail = mail
        self._package = package
        self._core: frozenset[str] | None = None
        self._cloud: frozenset[str] | None = None
        self._end: Callable[[], None] | None = None
        if package is not None:
            self._read(package)

    def _read(self, package: Path) -> None:
        rapp = json.loads((package / "package.json").read_text())["rapp"]
        self.parameters = rapp.get("parameters", {})
        self._core = frozenset(rapp["permissions"]["core"])
        self._cloud = frozenset(rapp["permissions"]["cloud"])
        self._partner = rapp.get("partner") is not None

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
        self._allow("rapp_say", self._core)
        _check(bool(text.strip()) and len(text) <= 4000, "say that: a text of 1 to 4000 characters is needed")
        _check(not any("\ud800" <= sign <= "\udfff" for sign in text), "say that: half a sign of UTF-16 is no text")
        if language.split("-")[0].lower() not in LANGUAGES:
            raise Refused(f"cannot speak language {language!r}: known are {', '.join(LANGUAGES)}")
        self.calls.append(("say", text))

    def recognize(self, dictionary: Sequence[str], timeout: float) -> str:
        """The person's next word when it is in the dictionary, else "Empty"."""
        self._allow("rapp_recognize", self._core)
        _check(1 <= len(dictionary) <= 100 and all(word.strip() for word in dictionary), "listen: give 1 to 100 words")
        self.calls.append(("recognize", list(dictionary)))
        word = self._hears.pop(0) if self._hears else ""
        return next((known for known in dictionary if known.lower() == word.lower()), "Empty")

    def record(self, duration: float) -> str:
        """The path of a recording."""
        self._allow("rapp_record", self._core)
        _check(0.1 <= duration <= 300, "record: 0.1 to 300 s are possible")
        self.calls.append(("record", duration))
        return self._recording("")

    def record_until_silence(self, path: str, waiting_time: float, microphone_energy: int) -> str:
        """The path of a recording."""
        self._allow("rapp_record_until_silence", self._core)
        _check(0.1 <= waiting_time <= 60 and microphone_energy > 0, "record: 0.1 to 60 s and an energy above 0 are needed")
        self.calls.append(("record_until_silence", (path, waiting_time, microphone_energy)))
        return self._recording(path)

    def _recording(self, wish: str) -> str:
        path = f"{RECORDINGS}/{wish or f'recording-{len(self.recordings) + 1}.ogg'}"
        _check(path.endswith(".ogg") and ".." not in path and not wish.startswith("/"), f"record into {wish}: name it x.ogg")
        self.recordings.append(path)
        return path

    def play_audio(self, path: str, position: float, volume: float, balance: float, loop: bool) -> None:
        """Note the path: of one of this run's recordings, or of a file in the package (in the sandbox: /rapp/package/...)."""
        self._allow("rapp_play_audio", self._core)
        _check(math.isfinite(position) and position >= 0, "play: position must be 0 or more")
        _check(0 <= volume <= 1 and -1 <= balance <= 1, "play: volume is 0 to 1, balance -1 to 1")
        own = self._package is not None and Path(path).is_relative_to("/rapp/package")
        own = own and (Path(str(self._package)) / Path(path).relative_to("/rapp/package")).is_file()
        _check(own or path in self.recordings, f"read {path}: give a file of the package or a recording")
        self.calls.append(("play_audio", path))

    def cloud_call(self, service: str, arguments: dict[str, Any], timeout: float, agent: bool) -> Any:
        """What `services`, or `agent_services`, says."""
        if not agent:
            self._allow(service, self._cloud)
        elif not self._partner:
            raise Refused("cannot call a cloud agent: the RApp's package.json names no partner")
        files = {name: value for name, value in arguments.items() if isinstance(value, Path)}
        plain = {name: value for name, value in arguments.items() if name not in files}
        arguments = json.loads(_json(service, plain)) | files
        self.calls.append(("agent_call" if agent else "cloud_call", service))
        services = self._agent_services if agent else self._services
        if service not in services:
            raise Refused(f"cannot call {service}: it is not among this test's services")
        answer = services[service]
        if isinstance(answer, RappError):
            raise answer
        return answer(arguments) if callable(answer) else answer

    def stop_cloud_agent(self) -> bool:
        """Note it."""
        self.calls.append(("stop_cloud_agent", None))
        there, self._partner = self._partner, False
        return there

    def send_mail(self, recipients: Sequence[str], subject: str, body: str, attachment: str) -> str:
        """Note the mail; answer what `mail` says."""
        self._allow("send_mail", self._cloud)
        if attachment and attachment not in self.recordings:
            raise Refused(f"cannot attach {attachment}: only recordings of this run may leave the robot")
        self.calls.append(("send_mail", list(recipients)))
        self.mails.append({"recipients": list(recipients), "subject": subject, "body": body, "attachment": attachment})
        if isinstance(self._mail, RappError):
            raise self._mail
        return self._mail

    def keep(self, name: str, data: bytes) -> str:
        """Have it in `kept`."""
        self._allow("rapp_keep", self._core)
        _check(re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", name) is not None, f"keep {name!r}: name a file such as table.jpg")
        if len(data) > KEPT_FILE:
            raise Refused(f"cannot keep {name}: it has {len(data)} bytes, {KEPT_FILE} are allowed; make it smaller")
        self.calls.append(("keep", name))
        self.kept[name] = data
        return f"{KEEPSAKES}/{name}"

    def pause(self, seconds: float) -> None:
        """Note it; no time passes."""
        self.calls.append(("pause", seconds))

    def _permit(self, name: str) -> None:
        self._allow(name, self._core)

    @staticmethod
    def _allow(name: str, permitted: frozenset[str] | None) -> None:
        if permitted is not None and name not in permitted:
            raise Refused(f"cannot call {name}: the RApp's package.json does not name it under permissions")


def _check(right: bool, what: str) -> None:
    if not right:
        raise Invalid(f"cannot {what}")


def _json(service: str, arguments: dict[str, Any]) -> str:
    try:
        return json.dumps(arguments, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise Invalid(f"cannot call {service}: its arguments are not JSON: {error}; give texts, numbers, lists") from error
