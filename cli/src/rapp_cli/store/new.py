"""`./rapp new NAME`: a small RApp to begin with, which runs at once."""

import argparse
import json
from pathlib import Path

from rapp_cli.errors import UsageError
from rapp_cli.store.place import told
from rapp_hop.hz.text import check_name

_AGENT = '''"""{title}: say here what it does."""

from rapp_api import DynamicAgent, cloud, communication


class {title}(DynamicAgent):
    """The dynamic agent: the part that runs on the robot."""

    def execute(self) -> None:
        """What the RApp does; when this returns, it has ended well."""
        person = cloud.call_wait("profile")["name"]
        communication.text_to_speech(f"hello {{person}}, this is {spoken}")
'''


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp new`."""
    parser.add_argument("name", help="lower case letters, digits and _")
    parser.add_argument("--folder", type=Path, default=Path(), metavar="DIR", help="where to make it (here)")


@told
def run(options: argparse.Namespace) -> int:
    """Write package.json and agent.py into a new folder."""
    name = check_name(options.name)
    folder: Path = options.folder / name
    if folder.exists():
        raise UsageError(f"cannot make {folder}: it is there already")
    spoken = " ".join(name.split("_"))
    folder.mkdir(parents=True)
    (folder / "package.json").write_text(json.dumps(_manifest(name, spoken), indent=2) + "\n")
    title = "".join(word.capitalize() for word in name.split("_"))
    (folder / "agent.py").write_text(_AGENT.format(title=title, spoken=spoken))
    print(f"{folder} is made: try it with ./rapp run {folder}, offer it with ./rapp publish {folder}")
    return 0


def _manifest(name: str, spoken: str) -> dict[str, object]:
    return {
        "name": name,
        "version": "1.0.0",
        "description": f"Says hello from {spoken}",
        "author": "",
        "rapp": {
            "agent": "dynamic",
            "entry": "agent.py",
            "runtime": "python3",
            "keywords": {"en": [spoken]},
            "sentences": {"en": [f"start {spoken} please"]},
            "permissions": {"core": ["rapp_say"], "cloud": ["profile"]},
            "partner": None,
            "needs": {"robot": ["nao"], "api": ">=1.0"},
        },
    }
