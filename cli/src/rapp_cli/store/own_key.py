"""`./rapp keys own NAME`: a publisher makes their key at home, where it stays; the platform gets what it has signed."""

import argparse
from pathlib import Path

from securesystemslib.signer import CryptoSigner

from rapp_cli.errors import UsageError
from rapp_cli.home.place import add_home_option
from rapp_cli.store.remote import (
    NEXT,
    RemoteStore,
    add_cloud_option,
    folder_of,
    free_place,
    remote_of,
    ring_of,
    signer_of,
    with_store,
)
from rapp_cloud.files import write_whole
from rapp_cloud.keys import KeyRing
from rapp_hop.hz.application import first_list, write_application
from rapp_hop.hz.standing import Standing
from rapp_hop.hz.text import check_name


def add_own_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp keys own` beside the name."""
    add_home_option(parser)
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="what to give to the platform's owner (NAME.publisher here)"
    )
    parser.add_argument("--after", type=int, default=0, metavar="N", help="number of the last list the store had (%(default)s)")
    parser.add_argument("--anew", action="store_true", help="make another key, in place of one that was revoked")
    parser.description = (
        "Makes a publisher's key, encrypted, in HOME/publisher, and the file by which a platform's owner lets them publish "
        "(./rapp keys new NAME --public FILE). With --cloud: a key to follow the one that is known there (./rapp keys rotate)."
    )
    add_cloud_option(parser)


def make_own(options: argparse.Namespace) -> int:
    """Make key and file. Raises UsageError when the words do not fit together."""
    name, ring = check_name(options.name), ring_of(folder_of(options))
    path: Path = options.output or Path(f"{name}.publisher")
    if name.startswith(NEXT):
        raise UsageError(f"cannot make a key for {name}: choose a name that does not begin with {NEXT}")
    if options.after < 0:
        raise UsageError(f"cannot follow list {options.after}: give the number that the platform's owner was told")
    if options.cloud:
        data, action = _to_follow(options, ring, name), "rotate"
    else:
        kept = free_place(ring, name) if options.anew and ring.has(name) else name  # the store says later which one counts
        if options.anew or not ring.has(name):
            ring.keep(kept, ring.new(name))
        data, action = write_application(name, ring.signer(kept), first_list(options.after)), "new"
    write_whole(path, data)
    print(f"{path}: give it to who keeps the platform, for ./rapp keys {action} {name} --public {path.name}")
    return 0


def _to_follow(options: argparse.Namespace, ring: KeyRing, name: str) -> bytes:
    async def look(store: RemoteStore) -> Standing:
        return await store.standing(name)

    standing = with_store(remote_of(options, token=False), look)
    if ring.has(name):
        signer_of(ring, standing)  # puts an earlier new key in its place
    follows: CryptoSigner = ring.new(name)
    ring.keep(free_place(ring, name), follows)
    return write_application(name, follows, standing.renewed())
