"""The home: the folder in which a robot and its cloud live from one day to the next, and what was settled at its last `up`."""

import argparse
import json
import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import platformdirs

from rapp_cli.errors import CommandError, UsageError
from rapp_cli.mail_account import MailAccount
from rapp_cloud.files import write_whole

LONGEST_SOCKET = 96  # bytes; Linux takes 107 for the path of a UNIX socket, supervisord appends its process id


@dataclass(frozen=True)
class Settings:
    """What one `up` has settled; kept in the home, so that the other commands and the next `up` know it."""

    name: str  # of the robot
    robot: str | None  # URL of a real robot's NAOqi, None for the simulator
    cloud: str | None  # URL of a platform that runs already, None for the home's own
    mail: MailAccount | None  # None for the home's own mail server
    simulator: tuple[str, ...]  # further words for the simulator
    ports: Mapping[str, int]  # by agent; all on this computer

    @property
    def bridge(self) -> str:
        """WebSocket URL of the rosbridge."""
        return f"ws://127.0.0.1:{self.ports['rosbridge']}"

    @property
    def naoqi(self) -> str:
        """URL of the robot's NAOqi."""
        return self.robot or f"tcp://127.0.0.1:{self.ports['nao_sim']}"

    @property
    def master(self) -> str:
        """URI of the ROS master."""
        return f"http://127.0.0.1:{self.ports['roscore']}"


@dataclass(frozen=True)
class Home:
    """The folder, and where things lie in it."""

    folder: Path

    @property
    def robot(self) -> Path:
        """The robot's data folder, $RAPP_HOME."""
        return self.folder / "robot"

    @property
    def cloud(self) -> Path:
        """All data of the platform."""
        return self.folder / "cloud"

    @property
    def joined(self) -> Path:
        """What `./rapp join` has brought from a platform: token and trusted root."""
        return self.folder / "joined"

    @property
    def maildir(self) -> Path:
        """Where the home's own mail server delivers."""
        return self.folder / "mail"

    @property
    def timeline(self) -> Path:
        """What the agents have published: JSON lines, see `rapp_cli.timeline`."""
        return self.folder / "timeline.jsonl"

    @property
    def logs(self) -> Path:
        """One log file per agent."""
        return self.folder / "logs"

    def log(self, agent: str) -> Path:
        """An agent's log."""
        return self.logs / f"{agent}.log"

    @property
    def supervision(self) -> Path:
        """The supervisor's own folder: its configuration, control socket and process id."""
        return self.folder / "supervisor"

    @property
    def socket(self) -> Path:
        """The supervisor's control socket; whoever may write to it rules the agents."""
        return self.supervision / "control.sock"

    @property
    def _kept(self) -> Path:
        return self.folder / "settings.json"

    def make(self) -> None:
        """Make the folders, for this user only. Raises UsageError for a place that cannot be a home, CommandError."""
        if len(bytes(self.socket)) > LONGEST_SOCKET:
            raise UsageError(f"cannot use {self.folder} as a home: its path is too long for a socket; give a shorter --home")
        if any(mark in str(self.folder) for mark in ";#%\n\r'\""):
            raise UsageError(f"cannot use {self.folder} as a home: give a --home without quotes, ;, # and %")
        try:
            for folder in (self.folder, self.robot, self.cloud, self.logs, self.supervision):
                folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError as error:
            raise CommandError(f"cannot make {self.folder}: {error.strerror}; give another --home") from error

    def keep(self, settings: Settings) -> None:
        """Write the settings down."""
        write_whole(self._kept, json.dumps(asdict(settings), default=str, indent=2).encode(), mode=0o600)

    def settings(self) -> Settings | None:
        """What the last `up` settled; None when there was none. Raises CommandError for a file that cannot be read."""
        try:
            return _settings(json.loads(self._kept.read_text()))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, KeyError) as error:
            raise CommandError(f"cannot read {self._kept}: {error}; remove it, then ./rapp up") from error

    def settled(self) -> Settings:
        """What the last `up` settled. Raises CommandError when there was none."""
        settings = self.settings()
        if settings is None:
            raise CommandError(f"cannot find a robot in {self.folder}: start one with {self.command('up')}")
        return settings

    def command(self, words: str) -> str:
        """How to call another command for this home."""
        option = "" if self.folder == default_folder() else f" --home {shlex.quote(str(self.folder))}"
        return f"./rapp {words}{option}"


def default_folder() -> Path:
    """The home when no other is given."""
    return Path(platformdirs.user_data_dir("rapp")) / "home"


def add_home_option(parser: argparse.ArgumentParser) -> None:
    """The option that all of these commands have."""
    parser.add_argument("--home", type=Path, default=default_folder(), metavar="DIR", help="where everything is kept (%(default)s)")


def home_of(options: argparse.Namespace) -> Home:
    """The home an option names."""
    return Home(options.home.expanduser().resolve())


def _settings(fields: dict[str, Any]) -> Settings:
    mail = fields.pop("mail")
    if mail is not None:
        file = mail.pop("password_file")
        mail = MailAccount(**mail, password_file=Path(file) if file else None)
    return Settings(**{**fields, "simulator": tuple(fields["simulator"])}, mail=mail)
