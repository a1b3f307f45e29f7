"""What the demo is asked to do: one frozen object, from options and environment."""

import argparse
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import platformdirs

from rapp_cli import mail_account
from rapp_cli.demo.mailbox import words_heard
from rapp_cli.errors import UsageError
from rapp_cli.mail_account import MailAccount
from rapp_cloud.profiles import sound_of

VOICE_MAIL, SHOW_AROUND, HAZARD = "voice-mail", "show-around", "hazard"
KEYWORDS = {VOICE_MAIL: "e-mail", SHOW_AROUND: "show me around", HAZARD: "is everything safe"}
SENTENCES = {
    VOICE_MAIL: "I would like to send a message to my daughter",
    SHOW_AROUND: "please take me on a tour of your room",
    HAZARD: "please look whether I have left the door open",
}
TIMEOUTS = {HAZARD: 300.0}  # s for the whole story, where it is not TIMEOUT
TIMEOUT = 180.0
WIDEST = 90.0  # degrees to which the door opens


@dataclass(frozen=True)
class DemoConfig:
    """One run of the demo."""

    story: str  # one of KEYWORDS
    folder: Path  # everything the run writes
    command: str  # what the person says first
    recipient: str  # the name the person says
    message: str  # the message the person speaks
    voice: str  # espeak-ng voice of the person
    robot: str | None  # URL of a real robot's NAOqi, None for the simulator
    cloud: str | None  # URL of a platform that runs already, None for one of the demo's own
    mail: MailAccount | None  # None for the demo's own mail server
    address: str  # the recipient's mail address; "" when a platform that runs already knows it
    timeout: float  # s, for the whole story
    obstacle: bool  # something stands in the way of the tour
    silent: bool  # the simulated robot is fed with text, and speaks without sound
    door: float = 40.0  # degrees to which the door stands open
    light: bool = True  # whether the lamp is on
    write: bool = False  # whether the carer is to be written to
    start: str = ""  # the place of the room where the robot starts; "": its usual one
    language: str = "en"  # of the robot's keywords


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp demo`; those for real equipment can be given by environment (RAPP_ROBOT, RAPP_CLOUD, ...)."""
    parser.add_argument("story", nargs="?", choices=list(KEYWORDS), default=VOICE_MAIL, help="what happens (%(default)s)")
    parser.add_argument("--long", action="store_true", help=f"say a whole sentence, such as “{SENTENCES[VOICE_MAIL]}”")
    parser.add_argument("--say", metavar="TEXT", help=f"what the person says first (default “{KEYWORDS[VOICE_MAIL]}”)")
    parser.add_argument("--recipient", default="Elizabeth", metavar="NAME", help="name of the recipient (%(default)s)")
    parser.add_argument(
        "--message",
        default="please bring the medicine and some water on Monday morning",
        metavar="TEXT",
        help="the spoken message (“%(default)s”)",
    )
    parser.add_argument("--voice", default="en-us+m3", help="espeak-ng voice of the person (%(default)s)")
    parser.add_argument("--obstacle", action="store_true", help="show-around: put a carton in the robot's way")
    parser.add_argument("--silent", action="store_true", help="words go as text in place of sound; not with voice-mail")
    hazard = parser.add_argument_group("hazard")
    hazard.add_argument("--door", type=float, metavar="DEGREES", help="how far the door stands open, 0 to 90 (40)")
    hazard.add_argument("--light", choices=("on", "off"), help="whether the lamp is on (on)")
    hazard.add_argument("--mail", action="store_true", help="the person wants the recipient to be told")
    hazard.add_argument("--start", metavar="PLACE", help="where in the room the robot starts, such as window, table, chair")
    parser.add_argument("--folder", type=Path, help="where the run writes (default: a new folder among your data)")
    parser.add_argument("--timeout", type=float, help=f"seconds for the whole story ({TIMEOUT:g}, hazard {TIMEOUTS[HAZARD]:g})")
    real = parser.add_argument_group("real equipment")
    real.add_argument("--robot", metavar="URL", help="NAOqi of a real NAO, such as tcp://nao.local:9559 [RAPP_ROBOT]")
    real.add_argument("--cloud", metavar="URL", help="a running platform [RAPP_CLOUD; RAPP_TOKEN_FILE, RAPP_ROOT_FILE]")
    mail_account.add_options(real)
    real.add_argument("--address", help="the recipient's mail address (default: one on the demo's own mail server)")


def read(options: argparse.Namespace, env: Mapping[str, str] = os.environ) -> DemoConfig:
    """Build the configuration; raises UsageError when options contradict each other."""
    account, cloud = mail_account.read(options, env), options.cloud or env.get("RAPP_CLOUD")
    if cloud and options.address:
        raise UsageError("cannot use --address with --cloud: that platform knows it; ./rapp cloud person contact changes it there")
    if account and not options.address and not cloud:
        raise UsageError("cannot use a real mail account without a real recipient: give --address NAME@DOMAIN")
    _check_story(options, env)
    if not sound_of(options.recipient) or not options.message.strip():
        raise UsageError("cannot send a voice-mail without --recipient, a name that can be said, and --message")
    if not words_heard(options.message, options.message):
        raise UsageError(f"cannot judge whether “{options.message}” arrives: give a --message with a word of three letters or more")
    return DemoConfig(
        story=options.story,
        folder=(options.folder or _new_folder()).resolve(),
        command=options.say or (SENTENCES if options.long else KEYWORDS)[options.story],
        recipient=options.recipient.strip(),
        message=options.message,
        voice=options.voice,
        robot=options.robot or env.get("RAPP_ROBOT"),
        cloud=cloud,
        mail=account,
        address="" if cloud else options.address or f"{_mailbox(options.recipient)}@home.example",
        timeout=options.timeout or TIMEOUTS.get(options.story, TIMEOUT),
        obstacle=options.obstacle,
        silent=options.silent,
        door=DemoConfig.door if options.door is None else options.door,
        light=options.light != "off",
        write=options.mail,
        start=options.start or "",
    )


def _check_story(options: argparse.Namespace, env: Mapping[str, str]) -> None:
    """Options that the story does not have, or a real robot cannot meet."""
    given = {
        SHOW_AROUND: {"--obstacle": options.obstacle, "--silent": options.silent},
        HAZARD: {
            "--door": options.door is not None, "--light": options.light, "--start": options.start, "--mail": options.mail,
            "--silent": options.silent,
        },
    }  # fmt: skip
    for option in sorted({name for known in given.values() for name, wished in known.items() if wished}):
        stories = [story for story, known in given.items() if option in known]
        if options.story not in stories:
            raise UsageError(f"cannot use {option} with {options.story}: it is for {' and '.join(stories)}")
        if options.robot or env.get("RAPP_ROBOT"):
            raise UsageError(f"cannot use {option} with a real robot: it is for the simulated room; see to it yourself")
    if options.silent and options.long:
        raise UsageError("cannot interpret a sentence without its sound: leave out --silent or --long")
    if options.door is not None and not 0 <= options.door <= WIDEST:
        raise UsageError(f"cannot open the door by {options.door:g} degrees: give 0 to {WIDEST:g}")


def _mailbox(name: str) -> str:
    return "".join(c if c.isascii() and c.isalnum() else "." for c in name.lower()).strip(".") or "recipient"


def _new_folder() -> Path:
    runs = Path(platformdirs.user_data_dir("rapp")) / "demo"
    return runs / f"{datetime.now():%Y%m%d-%H%M%S}-{os.getpid()}"
