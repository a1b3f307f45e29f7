"""`./rapp new NAME`: a small RApp to begin with, which runs at once."""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

from rapp_cli.errors import UsageError
from rapp_cli.store.place import told
from rapp_hop.hz.manifest import STOP
from rapp_hop.hz.text import check_name

_PYTHON = '''"""{title}: say here what it does."""

from rapp_api import DynamicAgent, cloud, communication


class {title}(DynamicAgent):
    """The dynamic agent: the part that runs on the robot."""

    def execute(self) -> None:
        """What the RApp does; when this returns, it has ended well."""
        person = cloud.call_wait("profile")["name"]
        communication.text_to_speech(f"hello {{person}}, this is {spoken}")
'''

_JAVASCRIPT = """// {title}: say here what it does.
"use strict";

const {{ DynamicAgent, cloud, communication }} = require("rapp_api");

// The dynamic agent: the part that runs on the robot.
module.exports = class {title} extends DynamicAgent {{
  // What the RApp does; when this ends, it has ended well.
  async execute() {{
    const {{ name: person }} = await cloud.call("profile");
    await communication.textToSpeech(`hello ${{person}}, this is {spoken}`);
  }}
}};
"""


@dataclass(frozen=True)
class _Language:
    """What a RApp is written in."""

    runtime: str
    entry: str
    program: str


_LANGUAGES = {False: _Language("python3", "agent.py", _PYTHON), True: _Language("javascript", "agent.js", _JAVASCRIPT)}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp new`."""
    parser.add_argument("name", help="lower case letters, digits and _")
    parser.add_argument("--javascript", action="store_true", help="in JavaScript instead of Python")
    parser.add_argument("--folder", type=Path, default=Path(), metavar="DIR", help="where to make it (here)")


@told
def run(options: argparse.Namespace) -> int:
    """Write package.json and the agent's program into a new folder."""
    name = check_name(options.name)
    folder: Path = options.folder / name
    if folder.exists():
        raise UsageError(f"cannot make {folder}: it is there already")
    language = _LANGUAGES[options.javascript]
    spoken = " ".join(name.split("_"))
    if spoken in STOP.values():
        raise UsageError(f"cannot make {name}: that is what one says to stop the robot; give another name")
    folder.mkdir(parents=True)
    (folder / "package.json").write_text(json.dumps(_manifest(name, spoken, language), indent=2) + "\n")
    title = "".join(word.capitalize() for word in name.split("_"))
    (folder / language.entry).write_text(language.program.format(title=title, spoken=spoken))
    print(f"{folder} is made: try it with ./rapp run {folder}, offer it with ./rapp publish {folder}")
    return 0


def _manifest(name: str, spoken: str, language: _Language) -> dict[str, object]:
    return {
        "name": name,
        "version": "1.0.0",
        "description": f"Says hello from {spoken}",
        "author": "",
        "rapp": {
            "agent": "dynamic",
            "entry": language.entry,
            "runtime": language.runtime,
            "keywords": {"en": [spoken]},
            "sentences": {"en": [f"start {spoken} please"]},
            "permissions": {"core": ["rapp_say"], "cloud": ["profile"]},
            "partner": None,
            "needs": {"robot": ["nao"], "api": ">=1.0"},
        },
    }
