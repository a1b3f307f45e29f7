"""`python -m rapp_cloud`: serve; `… init`: make a platform and a token; `… publish`: offer a RApp; see `administration` too."""

import argparse
import asyncio
import json
import logging
import os
import resource
import signal
import sys
from pathlib import Path

import uvloop

from rapp_cloud.administration import COMMANDS, administer
from rapp_cloud.app import open_shelf, running_cloud
from rapp_cloud.config import PREFIX, CloudConfig, load_config
from rapp_cloud.files import write_whole
from rapp_cloud.keys import PASSPHRASE, passphrase_from
from rapp_cloud.memory import open_memory
from rapp_cloud.shelf import Shelf
from rapp_cloud.tls import CERTIFICATE, make_certificate, may_be_made_anew
from rapp_cloud.witness import noting_offers
from rapp_hop.errors import HopError
from rapp_hop.hz.archive import build
from rapp_hop.hz.text import check_name

_OPEN_FILES = 65536  # connections, files on their way and pipes of one platform


def main(words: list[str] | None = None, program: str = "python -m rapp_cloud", data: Path | None = None) -> int:
    """Run the command that the words name; return its exit status. For program and data see `administer`."""
    words = sys.argv[1:] if words is None else words
    logging.basicConfig(stream=sys.stderr, level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s")
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # what is in our memory must not lie about on the disk
    commands = {"init": _init, "publish": _publish}
    try:
        if words and words[0] in commands:
            return commands[words[0]](words[1:])
        if words and words[0] in COMMANDS:
            return administer(words, program, data)
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            return runner.run(_serve(_options(words)))
    except HopError as error:
        print(error, file=sys.stderr)
    except OSError as error:
        print(f"cannot use {error.filename}: {error.strerror}", file=sys.stderr)
    return 1


def _options(words: list[str]) -> CloudConfig:
    parser = argparse.ArgumentParser(
        "python -m rapp_cloud", description="The RAPP platform; commands: init, publish, " + ", ".join(COMMANDS)
    )
    parser.add_argument("--data", type=Path, required=True, metavar="DIR", help="made by `init`")
    parser.add_argument("--port", type=int, help="0: any free one")
    parser.add_argument("--address", help="to listen on")
    parser.add_argument("--certificate", type=Path, metavar="FILE", help="for TLS; default: none on loopback")
    parser.add_argument("--certificate-key", type=Path, metavar="FILE", help="its key")
    parser.add_argument("--publish", action="append", metavar="DIR", help="source of a RApp to offer; may be repeated")
    parser.add_argument("--passphrase-file", type=Path, metavar="FILE", help="of the store's keys; default: beside them")
    parser.add_argument("--workers", type=int, help="processes for interpretation")
    options = vars(parser.parse_args(words))
    config = load_config(options.pop("data"), options, os.environ)
    for name in (PASSPHRASE, f"{PREFIX}DATABASE"):  # our workers have no business with them
        os.environ.pop(name, None)
    return config


def _allow_open_files() -> None:
    """The system's first limit is often 1024, for programs that use select()."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _OPEN_FILES if hard == resource.RLIM_INFINITY else min(hard, _OPEN_FILES)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


async def _serve(config: CloudConfig) -> int:
    _allow_open_files()
    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    async with running_cloud(config) as port:
        print("READY " + json.dumps({"port": port}), flush=True)
        await stop.wait()
    return 0


def _init(words: list[str]) -> int:
    parser = argparse.ArgumentParser("python -m rapp_cloud init", description="Make keys, a store, a robot's token.")
    parser.add_argument("--data", type=Path, required=True, metavar="DIR")
    parser.add_argument("--robot", required=True, metavar="NAME")
    parser.add_argument("--host", action="append", metavar="NAME", help="make a certificate for this name or address too")
    options = parser.parse_args(words)
    data, robot = options.data, check_name(options.robot)
    data.mkdir(parents=True, exist_ok=True, mode=0o700)
    shelf = open_shelf(data, passphrase_from(os.environ))
    if shelf.root_file.exists():
        shelf.adopt()
    else:
        shelf.create()
    write_whole(data / "root.json", shelf.root_file.read_bytes())
    token_file = data / "robots" / f"{robot}.token"
    if not token_file.exists():
        token_file.parent.mkdir(exist_ok=True, mode=0o700)
        with open_memory(data, load_config(data, {}, os.environ).database) as memory:
            write_whole(token_file, memory.accounts.add_robot(robot).encode(), mode=0o600)
    given = [token_file, data / "root.json"]
    if options.host:
        certificate = data / "tls" / CERTIFICATE
        if not certificate.exists() or may_be_made_anew(certificate):
            make_certificate(data / "tls", options.host)
        given.append(certificate)
    print(f"give to the robot: {', '.join(map(str, given))}")
    return 0


def _publish(words: list[str]) -> int:
    parser = argparse.ArgumentParser("python -m rapp_cloud publish", description="Build, sign and offer RApps.")
    parser.add_argument("--data", type=Path, required=True, metavar="DIR")
    parser.add_argument("sources", nargs="+", type=Path, metavar="FOLDER")
    options = parser.parse_args(words)
    shelf = open_shelf(options.data, passphrase_from(os.environ))
    with noting_offers(options.data, shelf, load_config(options.data, {}, os.environ).database):
        return max([_offer(shelf, folder) for folder in options.sources])


def _offer(shelf: Shelf, folder: Path) -> int:
    try:
        manifest = shelf.publish(build(folder))
    except HopError as error:  # the others may be right
        print(error, file=sys.stderr)
        return 1
    print(f"on offer: {manifest.name} {manifest.version}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
