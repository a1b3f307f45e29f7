"""A whole robot whose ways to platform and mail server have the faults that a test wants."""

import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from fakes.faulty_cloud import FaultyCloud
from fakes.faulty_mail import FaultyMail
from fakes.whole_robot import PATIENCE, Seen, WholeRobot, entered

BOUND = 10.0  # s to say what failed and to listen again, once the fault is known to the robot


class RobotBehindFaults(WholeRobot):
    """`cloud_line` and `mail_line` are the ways."""

    def __init__(
        self, folder: Path, publish: Sequence[Path] = (), profile: Mapping[str, Any] | None = None, login: bool = False
    ) -> None:
        """See `WholeRobot`; `login`: the mail server wants one."""
        super().__init__(folder, publish, profile)
        self.cloud_line = FaultyCloud(self.cloud_port)
        self.cloud_url = self.cloud_line.url
        self.mail_line = FaultyMail(self.mail_port, login=login)
        self._login = login
        self.microphone = "text"  # or "sound"

    def _environment(self) -> dict[str, str]:
        account = {"RAPP_SMTP_USER": "nao@home.example", "RAPP_SMTP_PASSWORD": "secret"} if self._login else {}
        return {**super()._environment(), "RAPP_SMTP_PORT": str(self.mail_line.port), **account}

    def _words(self, name: str) -> list[str]:
        words = super()._words(name)
        return [word if word != "text" else self.microphone for word in words] if name == "nao_sim" else words

    def close(self) -> None:
        """End everything."""
        super().close()
        self.cloud_line.close()
        self.mail_line.close()

    def ask(self, keyword: str, state: str = "s4") -> Seen:
        """See `WholeRobot.ask`; the microphone is text-fed, so a word costs nothing and can be said often."""
        return self.say_until(keyword, entered(state), len(self.seen))

    def command(self, text: str) -> int:
        """The person says a whole sentence, again when it was not heard; gives where the story of it begins."""
        since = len(self.seen)
        for _ in range(4):
            self.room("personSay", text, "en-us+m3", {"speed": 200.0})
            with suppress(AssertionError):
                self.until(entered("s5"), since, 5.0)
                return since
        raise AssertionError(f"{text!r} was not heard\n{self.story(since)}")

    def wait_for(self, done: Callable[[], bool]) -> None:
        """Wait for something that the robot does not publish."""
        deadline = time.monotonic() + PATIENCE
        while not done():
            assert time.monotonic() < deadline, self.story(max(0, len(self.seen) - 60))
            time.sleep(0.05)

    def forget(self, name: str) -> None:
        """Take a RApp off the robot's disk, so that it has to be downloaded again."""
        shutil.rmtree(self.home / "rapps" / name, ignore_errors=True)

    def served(self, keyword: str, words: str) -> None:
        """Ask for a RApp; it says `words` and ends, and the robot listens again."""
        since = len(self.seen)
        self.ask(keyword)
        said = self.until(lambda seen: seen.kind == "said" and seen.detail == words, since)
        self.until_listening(self.seen.index(said))

    def refused(self, since: int) -> str:
        """What the robot says in s11 on its way back to s3, within the bound."""
        deadline = time.monotonic() + BOUND
        said = self.until(lambda seen: (seen.kind, seen.state) == ("said", "s11"), since, BOUND)
        self.until_listening(self.seen.index(said), max(0.1, deadline - time.monotonic()))
        return said.detail
