"""`./rapp hz build|inspect|sign|verify`: HZ packages as files, without a store (deliverable §4.2)."""

import argparse
import hashlib
import io
import json
from pathlib import Path

from rapp_cli.store.place import add_store_options, keys_of, store_of, told
from rapp_cloud.files import write_whole
from rapp_hop.hz.archive import build, inspect, package_file_name
from rapp_hop.hz.signature import sign_package, verify_package

SUFFIX = ".sig"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp hz`."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    building = actions.add_parser("build", help="make a package of a folder; the same folder gives the same bytes")
    building.add_argument("folder", type=Path)
    building.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: NAME-VERSION.hz here")
    inspecting = actions.add_parser("inspect", help="check a package and show what is in it")
    signing = actions.add_parser("sign", help=f"write FILE{SUFFIX}, with a publisher's key of a store")
    signing.add_argument("--publisher", default="rapp", metavar="NAME", help="whose key (%(default)s)")
    verifying = actions.add_parser("verify", help=f"check a package against FILE{SUFFIX}")
    verifying.add_argument(
        "--key", action="append", metavar="ID", help="a key to believe, see ./rapp keys list; default: the store's"
    )
    for action in (inspecting, signing, verifying):
        action.add_argument("file", type=Path)
    for action in (signing, verifying):
        action.add_argument("--signature", type=Path, metavar="FILE", help=f"default: FILE{SUFFIX}")
        add_store_options(action)


@told
def run(options: argparse.Namespace) -> int:
    """Do one of them; 0 when the package is right."""
    return {"build": _build, "inspect": _inspect, "sign": _sign, "verify": _verify}[options.action](options)


def _build(options: argparse.Namespace) -> int:
    package = build(options.folder)
    manifest = inspect(io.BytesIO(package)).manifest
    path: Path = options.output or Path(package_file_name(manifest.name, manifest.version.text))
    write_whole(path, package)
    print(f"{path}: {len(package)} bytes, sha256 {hashlib.sha256(package).hexdigest()}")
    return 0


def _inspect(options: argparse.Namespace) -> int:
    with options.file.open("rb") as file:
        contents = inspect(file)
    for member in contents.members:
        kind = "d" if member.folder else "x" if member.executable else "-"
        print(f"{kind} {member.size:>9} {'/'.join(member.path)}")
    manifest = contents.manifest
    print(f"{manifest.name} {manifest.version}: {manifest.description}")
    told_of = {"agent": manifest.agent, "core": manifest.permissions.core, "cloud": manifest.permissions.cloud}
    print(json.dumps({**told_of, "keywords": dict(manifest.keywords), "sentences": dict(manifest.sentences)}, ensure_ascii=False))
    return 0


def _sign(options: argparse.Namespace) -> int:
    signer = keys_of(options).signer(options.publisher)
    path = _signature(options)
    write_whole(path, sign_package(options.file.read_bytes(), signer))
    print(f"{path}: signed by {signer.public_key.keyid}")
    return 0


def _verify(options: argparse.Namespace) -> int:
    keys = options.key or [key for holder in store_of(options).custody.publishers() for key in holder.keys]
    found = verify_package(options.file.read_bytes(), _signature(options).read_bytes(), frozenset(keys))
    print(f"{options.file}: {found.manifest.name} {found.manifest.version}, signed by {found.keyid}")
    return 0


def _signature(options: argparse.Namespace) -> Path:
    path: Path | None = options.signature
    return path or options.file.with_name(options.file.name + SUFFIX)
