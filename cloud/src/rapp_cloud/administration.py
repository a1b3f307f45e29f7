"""The commands of who runs a platform: back-ups, accounts, tokens, persons, audit log. Each works beside a platform that serves."""

import argparse
import getpass
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TextIO

from rapp_cloud.backup import back_up, passphrase_of, restore
from rapp_cloud.config import load_config
from rapp_cloud.keys import Passphrase, passphrase_from
from rapp_cloud.memory import Memory, open_memory
from rapp_cloud.people_commands import add_actions
from rapp_cloud.witness import operator
from rapp_hop.errors import Refused

Make = Callable[[str, str], argparse.ArgumentParser]
"""Makes a command's parser, from its name and what it is for."""


def _parser(program: str, data: Path | None, command: str, description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(f"{program} {command}", description=description)
    parser.add_argument("--data", type=Path, required=data is None, default=data, metavar="DIR", help="the platform's folder")
    return parser


def _database(data: Path) -> str | None:
    return load_config(data, {}, os.environ).database


def _backup(make: Make, words: list[str]) -> int:
    parser = make(
        "backup", "Write all that a platform keeps into one file; its secrets too, but not the passphrase of the store's keys."
    )
    parser.add_argument("file", type=Path, metavar="FILE")
    options = parser.parse_args(words)
    config, word = load_config(options.data, {}, os.environ), passphrase_of(options.file)
    length = back_up(options.data, config.database, options.file, Passphrase(config.passphrase, config.passphrase_file))
    print(f"{options.file}: {length} bytes; keep it where nobody else can read it")
    kept = word if word.exists() else "it"
    print(f"the passphrase of the store's keys is not in it, and nothing opens them without: keep {kept} too, apart")
    return 0


def _restore(make: Make, words: list[str]) -> int:
    parser = make("restore", "Make a platform of a back-up, in an empty folder and an empty database.")
    parser.add_argument("file", type=Path, metavar="FILE")
    options = parser.parse_args(words)
    done = restore(options.data, _database(options.data), options.file, passphrase_from(os.environ))
    print(f"{options.data} is the platform of {datetime.fromtimestamp(done.at, UTC):%F %T} UTC")
    print("what was published after that is not on offer: publish it again as it was, or with a higher version")
    print("what was revoked after that is good again, tokens and publishers' keys: revoke it again")
    for package in done.expired:
        print(refused_until_renewed(package))
    if done.left:
        again = "when that is mended, run ./rapp keys resume"
        print(f"robots that saw the newer store refuse this one yet: {done.left}; {again}", file=sys.stderr)
    return 1 if done.left else 0


def refused_until_renewed(package: str) -> str:
    """Return what to say of a package that `Custody.resume` could not vouch for."""
    return f"robots refuse {package}: its list has expired, its publisher must run ./rapp store renew --cloud URL"


def _invite(make: Make, words: list[str]) -> int:
    parser = make("invite", "Print a code by which a robot may come in, once.")
    parser.add_argument("robot", metavar="ROBOT")
    parser.add_argument("--hours", type=float, default=24.0, help="that the code is good (%(default)g)")
    options = parser.parse_args(words)
    root = options.data / "root.json"
    if not root.exists():
        raise Refused(f"cannot find {root}: run rapp_cloud init first")
    with _memory(options) as memory:
        print(memory.admission.invite(options.robot, options.hours * 3600, root.read_bytes()))
        memory.audit.add(operator(), "invite", options.robot)
    return 0


def _account(make: Make, words: list[str]) -> int:
    parser = make("account", "Make a person's account, or give it another password, which is read from the terminal or stdin.")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("--role", choices=("user", "publisher"), default="user")
    options = parser.parse_args(words)
    password = getpass.getpass() if sys.stdin.isatty() else sys.stdin.readline().rstrip("\n")
    with _memory(options) as memory:
        memory.admission.enrol(options.name, options.role, password)
        memory.audit.add(operator(), "account", options.name, role=options.role)
    print(f"{options.name} is a {options.role}")
    return 0


def _token(make: Make, words: list[str]) -> int:
    parser = make("token", "Make a token and write it into a file.")
    parser.add_argument("name", metavar="NAME", help="whose")
    parser.add_argument("file", type=Path, metavar="FILE", help="to write it to; must not be there")
    parser.add_argument("--scope", action="append", default=[], help="what it allows (all that its holder may); may be repeated")
    parser.add_argument("--days", type=float, help="that it is good (until it is revoked)")
    parser.add_argument("--rate", type=float, help="calls per second (the platform's)")
    parser.add_argument("--quota", type=int, help="calls and packages per day (any number)")
    options = parser.parse_args(words)
    life = options.days * 86400 if options.days else None
    with _memory(options) as memory:
        with _new_file(options.file) as file:
            file.write(memory.accounts.give(options.name, options.scope, life, rate=options.rate, quota=options.quota))
        memory.audit.add(operator(), "token", options.name, scopes=options.scope)
    print(f"{options.file} has a token of {options.name}")
    return 0


@contextmanager
def _new_file(path: Path) -> Iterator[TextIO]:
    """A file for its owner alone, which must not be there before; none is left when the block fails."""
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    try:
        with os.fdopen(handle, "w") as file:
            yield file
    except BaseException:
        path.unlink()
        raise


def _tokens(make: Make, words: list[str]) -> int:
    options = make("tokens", "List the tokens: id, whose, what they allow, until when.").parse_args(words)
    with _memory(options) as memory:
        for one in memory.accounts.list():
            until = f"until {datetime.fromtimestamp(one.expires, UTC):%F %R}" if one.expires else ""
            print(f"{one.token:<14} {one.name:<24} {' '.join(sorted(one.scopes)):<14} {until}".rstrip())
    return 0


def _revoke(make: Make, words: list[str]) -> int:
    parser = make("revoke", "Take back a token by its id, or all tokens of an account.")
    parser.add_argument("which", metavar="ID|NAME")
    options = parser.parse_args(words)
    with _memory(options) as memory:
        count = memory.accounts.revoke(options.which)
        memory.audit.add(operator(), "revoke", options.which, count=count)
    print(f"{count} revoked")
    return 0 if count else 1


def _person(make: Make, words: list[str]) -> int:
    parser = make("person", "The persons of a home: what they are called, whom they write to, which robots serve them.")
    add_actions(parser)
    options = parser.parse_args(words)
    with _memory(options) as memory:
        print(options.do(memory, options))
        if options.deed != "person show":
            memory.audit.add(operator(), options.deed, getattr(options, "person", None) or options.robot)
    return 0


def _audit(make: Make, words: list[str]) -> int:
    parser = make("audit", "Show the audit log; with --check, look whether it was changed.")
    parser.add_argument("--last", type=int, default=100, metavar="N", help="entries (%(default)s)")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--seal", default="", help="that must be in it, such as the last of the platform's log")
    options = parser.parse_args(words)
    with _memory(options) as memory:
        if options.check or options.seal:
            print(f"{memory.audit.check(options.seal)} entries, all as they were written")
            return 0
        for entry in memory.audit.entries(options.last):
            at = datetime.fromtimestamp(entry.at, UTC)
            print(f"{entry.number:>6} {at:%F %T} {entry.who:<20} {entry.deed:<10} {entry.subject} {json.dumps(entry.detail)}")
    return 0


@contextmanager
def _memory(options: argparse.Namespace) -> Iterator[Memory]:
    with open_memory(options.data, _database(options.data)) as memory:
        yield memory


COMMANDS: Mapping[str, Callable[[Make, list[str]], int]] = {
    "backup": _backup, "restore": _restore, "invite": _invite, "account": _account, "token": _token, "tokens": _tokens,
    "revoke": _revoke, "person": _person, "audit": _audit,
}  # fmt: skip
"""By the word after `python -m rapp_cloud`."""


def administer(words: list[str], program: str, data: Path | None) -> int:
    """Run the command that the first of the words names; return its exit status.

    :param program: what stands before the words, where they are typed
    :param data: the platform's folder, when the words do not say it
    """
    return COMMANDS[words[0]](partial(_parser, program, data), words[1:])
