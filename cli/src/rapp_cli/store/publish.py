"""`./rapp publish DIR`: checks a RApp as the store does, signs for it, puts it on offer."""

import argparse
import io
from pathlib import Path

from rapp_cli.errors import UsageError
from rapp_cli.store.permissions import missing_permissions
from rapp_cli.store.place import add_store_options, noting, store_of, told
from rapp_cloud.publishing import check_publication
from rapp_hop.hz.archive import build, inspect


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp publish`."""
    parser.add_argument("folder", type=Path, help="with package.json; of a four-agent RApp, with dynamic/ and cloud/")
    parser.add_argument("--publisher", metavar="NAME", help="who signs, see ./rapp keys (default: whose name it is, or rapp)")
    parser.add_argument("--only", action="append", default=[], metavar="ROBOT", help="offer it to this robot only; may be repeated")
    parser.add_argument("--check", action="store_true", help="only check, publish nothing")
    add_store_options(parser)


@told
def run(options: argparse.Namespace) -> int:
    """Publish; raises UsageError naming what must change first."""
    shelf = store_of(options)
    for folder in parts(options.folder):
        package = build(folder)
        manifest = inspect(io.BytesIO(package)).manifest
        missing = missing_permissions(folder, manifest)
        if missing:
            raise UsageError(f"cannot publish {manifest.name}: package.json does not ask for what it uses: {', '.join(missing)}")
        if options.check:
            check_publication(manifest, [offer.manifest for offer in shelf.offers()])
            print(f"can be published: {manifest.name} {manifest.version}")
            continue
        with noting(options, shelf):
            shelf.publish(package, options.publisher, tuple(options.only), check_publication)
        print(f"on offer: {manifest.name} {manifest.version}, {len(package)} bytes")
    return 0


def parts(folder: Path) -> list[Path]:
    """The folders of a RApp's packages, the cloud agent's first. Raises UsageError when there are none."""
    if (folder / "package.json").is_file():
        return [folder]
    found = [folder / name for name in ("cloud", "dynamic") if (folder / name / "package.json").is_file()]
    if not found:
        raise UsageError(f"cannot find a RApp in {folder}: it has no package.json, ./rapp new makes one")
    return found
