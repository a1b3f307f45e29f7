"""`./rapp join URL`: makes this robot one of a platform's, by the one-time code that `rapp_cloud invite` has given."""

import argparse
import asyncio
import getpass
import hashlib
import io
import os
import sys
from pathlib import Path

from rapp_cli.cloud import check_url
from rapp_cli.errors import CommandError, UsageError
from rapp_cli.home.place import add_home_option, home_of
from rapp_cloud.admission import ROOT_DIGITS
from rapp_cloud.files import write_whole
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError

PATIENCE = 20.0  # s
MAX_ROOT = 512 * 1024  # bytes
ROOT = "/tuf/metadata/1.root.json"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp join`."""
    add_home_option(parser)
    parser.add_argument("url", metavar="URL", help="of the platform, such as https://rapp.example:9001")


def run(options: argparse.Namespace) -> int:
    """Redeem the code, which is read from the terminal or from stdin."""
    url, home = check_url(options.url), home_of(options)
    code = (getpass.getpass("Code: ") if sys.stdin.isatty() else sys.stdin.readline()).strip()
    ca_file = Path(os.environ["RAPP_CLOUD_CA_FILE"]) if os.environ.get("RAPP_CLOUD_CA_FILE") else None
    try:
        robot = asyncio.run(_join(url, code, home.joined, ca_file))
    except HopError as error:
        raise CommandError(str(error)) from error
    except OSError as error:
        raise CommandError(f"cannot write {error.filename}: {error.strerror}") from error
    print(f"this robot is {robot}: {home.command(f'up --name {robot} --cloud {url}')}")
    return 0


async def _join(url: str, code: str, folder: Path, ca_file: Path | None) -> str:
    """Write token and root into the folder; the root first, as a code is good once only."""
    client, root = HopClient(url, None, ca_file=ca_file), io.BytesIO()
    try:
        await client.download(ROOT, root.write, MAX_ROOT, PATIENCE)
        wanted = code.partition("-")[2]
        if wanted.encode() != hashlib.sha256(root.getvalue()).hexdigest()[:ROOT_DIGITS].encode():
            raise UsageError("cannot trust this platform: its store is not the one of the code; check URL and code")
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        write_whole(folder / "root.json", root.getvalue())
        answer = await client.call_url("/join", {"code": code}, PATIENCE)
        write_whole(folder / "token", str(answer["token"]).encode(), mode=0o600)
        return str(answer["robot"])
    finally:
        await client.close()
