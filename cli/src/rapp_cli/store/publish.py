"""`./rapp publish DIR`: checks a RApp as the store does, signs for it, puts it on offer; with `--cloud`, in a store elsewhere."""

import argparse
import io
import sys
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
    (_publish_far if options.cloud else _publish_here)(options, packages)
    if not options.check:
        print("rapp publish: robots look at what is on offer every minute; then ask for it", file=sys.stderr)
    return 0


def _built(folder: Path) -> tuple[Manifest, bytes]:
    package = build(folder)
    manifest = inspect(io.BytesIO(package)).manifest
    missing = missing_permissions(folder, manifest)
    if missing:
        raise UsageError(f"cannot publish {manifest.name}: package.json does not ask for what it uses: {', '.join(missing)}")
    return manifest, package


def _publish_here(options: argparse.Namespace, packages: list[tuple[Manifest, bytes]]) -> None:
    shelf = store_of(options)
    if options.check:
        offered = [offer.manifest for offer in shelf.offers()]
        for manifest, package in packages:
            check_publication(manifest, offered)
            offered.append(manifest)
            _tell("can be published", manifest, package)
        return
    with noting(options, shelf):
        for manifest, package in packages:
            shelf.publish(package, options.publisher, tuple(options.only))
            _tell("on offer", manifest, package)


def _publish_far(options: argparse.Namespace, packages: list[tuple[Manifest, bytes]]) -> None:
    remote, ring = remote_of(options), ring_of(folder_of(options))
    publisher = publisher_of(ring, options.publisher)
    to_come: set[str | None] = set()  # packages of this RApp that are not on offer after a mere check

    async def publish(store: RemoteStore) -> None:
        for manifest, package in packages:
            standing = await store.standing(publisher)
            follows = standing.with_package(manifest, package, tuple(options.only))
            if manifest.partner in to_come:
                _tell(f"the platform cannot check it before {manifest.partner} is on offer", manifest, package)
                continue
            if follows is not None:
                await store.publish(package, signed(follows, signer_of(ring, standing)), check=options.check)
                to_come.update({manifest.name} if options.check else ())
            _tell("can be published" if options.check else "on offer", manifest, package)

    with_store(remote, publish)


def _tell(done: str, manifest: Manifest, package: bytes) -> None:
    print(f"{done}: {manifest.name} {manifest.version}, {len(package)} bytes")


def parts(folder: Path) -> list[Path]:
    """The folders of a RApp's packages, the cloud agent's first. Raises UsageError when there are none."""
    if (folder / "package.json").is_file():
        return [folder]
    found = [folder / name for name in ("cloud", "dynamic") if (folder / name / "package.json").is_file()]
    if not found:
        raise UsageError(f"cannot find a RApp in {folder}: it has no package.json, ./rapp new makes one")
    return found
