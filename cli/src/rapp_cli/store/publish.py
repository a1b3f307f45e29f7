"""`./rapp publish DIR`: checks a RApp as the store does, signs for it, puts it on offer; with `--cloud`, in a store elsewhere."""

import argparse
import io
from pathlib import Path

from rapp_cli.errors import UsageError
from rapp_cli.store.permissions import missing_permissions
from rapp_cli.store.place import add_store_options, noting, store_of, told
from rapp_cli.store.remote import (
    RemoteStore,
    add_cloud_option,
    folder_of,
    publisher_of,
    remote_of,
    ring_of,
    signer_of,
    with_store,
)
from rapp_cloud.publishing import check_publication
from rapp_hop.hz.archive import build, inspect
from rapp_hop.hz.manifest import Manifest
from rapp_hop.hz.standing import signed


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp publish`."""
    parser.add_argument("folder", type=Path, help="with package.json; of a four-agent RApp, with dynamic/ and cloud/")
    parser.add_argument(
        "--publisher", metavar="NAME", help="who signs (whose name it is, or rapp; with --cloud, whose key is here)"
    )
    parser.add_argument("--only", action="append", default=[], metavar="ROBOT", help="offer it to this robot only; may be repeated")
    parser.add_argument("--check", action="store_true", help="only check, publish nothing")
    add_store_options(parser)
    add_cloud_option(parser)


@told
def run(options: argparse.Namespace) -> int:
    """Publish; raises UsageError naming what must change first."""
    packages = [_built(folder) for folder in parts(options.folder)]
    done = _publish_far(options, packages) if options.cloud else _publish_here(options, packages)
    for manifest, package in packages:
        print(f"{done}: {manifest.name} {manifest.version}, {len(package)} bytes")
    return 0


def _built(folder: Path) -> tuple[Manifest, bytes]:
    package = build(folder)
    manifest = inspect(io.BytesIO(package)).manifest
    missing = missing_permissions(folder, manifest)
    if missing:
        raise UsageError(f"cannot publish {manifest.name}: package.json does not ask for what it uses: {', '.join(missing)}")
    return manifest, package


def _publish_here(options: argparse.Namespace, packages: list[tuple[Manifest, bytes]]) -> str:
    shelf = store_of(options)
    if options.check:
        for manifest, _ in packages:
            check_publication(manifest, [offer.manifest for offer in shelf.offers()])
        return "can be published"
    with noting(options, shelf):
        for _, package in packages:
            shelf.publish(package, options.publisher, tuple(options.only), check_publication)
    return "on offer"


def _publish_far(options: argparse.Namespace, packages: list[tuple[Manifest, bytes]]) -> str:
    remote, ring = remote_of(options), ring_of(folder_of(options))
    publisher = publisher_of(ring, options.publisher)

    async def publish(store: RemoteStore) -> None:
        for manifest, package in packages:
            standing = await store.standing(publisher)
            follows = standing.with_package(manifest, package, tuple(options.only))
            if follows is not None:
                await store.publish(package, signed(follows, signer_of(ring, standing)), check=options.check)

    with_store(remote, publish)
    return "can be published" if options.check else "on offer"


def parts(folder: Path) -> list[Path]:
    """The folders of a RApp's packages, the cloud agent's first. Raises UsageError when there are none."""
    if (folder / "package.json").is_file():
        return [folder]
    found = [folder / name for name in ("cloud", "dynamic") if (folder / name / "package.json").is_file()]
    if not found:
        raise UsageError(f"cannot find a RApp in {folder}: it has no package.json, ./rapp new makes one")
    return found
