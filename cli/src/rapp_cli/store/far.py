"""`./rapp store list|show|yank|renew --cloud URL`: a store elsewhere. What is shown was verified as a robot does it."""

import argparse
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from tuf.api.metadata import Targets  # type: ignore[attr-defined]  # public, but not in __all__

from rapp_cli.errors import UsageError
from rapp_cli.store.remote import (
    RemoteStore,
    folder_of,
    publisher_of,
    remote_of,
    ring_of,
    signer_of,
    with_store,
)
from rapp_hop.hz.archive import inspect
from rapp_hop.hz.manifest import Manifest
from rapp_hop.hz.standing import Standing, package_of, signed
from rapp_hop.hz.text import check_name
from rapp_hop.hz.trust import Versions, choose


def list_far(options: argparse.Namespace) -> int:
    """One line per package."""
    standings, now = with_store(remote_of(options, token=False), RemoteStore.standings), datetime.now(UTC)
    for standing in standings:
        for path, target in sorted(standing.own.targets.items()):
            name, _, version = path.removesuffix(".hz").partition("-")
            late = "" if standing.own.expires > now else f"  expired, {standing.publisher} must run ./rapp store renew"
            print(f"{name:<24} {version:<12} {standing.publisher:<12} {target.length:>9} bytes{late}")
    return 0


def show_far(options: argparse.Namespace) -> int:
    """All versions of a RApp, and what the newest one says of itself. Raises UsageError when there is none."""
    name = check_name(options.name)

    async def look(store: RemoteStore) -> tuple[Manifest, str, Versions]:
        offered = await store.versions(name)
        if not offered.releases:
            what = f"its versions are yanked ({', '.join(sorted(offered.yanked))})" if offered.yanked else "it is not in the store"
            raise UsageError(f"cannot show {name}: {what}, see ./rapp store list")
        owners = [one.publisher for one in await store.standings() if name in _names(one)]
        with tempfile.TemporaryDirectory() as folder:
            package = Path(folder, "package")
            await store.download(choose(offered, name), package)
            with package.open("rb") as file:
                return inspect(file).manifest, ", ".join(owners), offered

    manifest, publisher, offered = with_store(remote_of(options, token=False), look)
    for line in about(manifest, publisher):
        print(line)
    for release in offered.releases:
        state = "for " + ", ".join(release.robots) if release.robots else ""
        sha256 = release.target.hashes["sha256"]
        print(f"  {release.version.text:<12} {release.length:>9} bytes  sha256 {sha256}  {state}".rstrip())
    for version in sorted(offered.yanked):
        print(f"  {version:<12} yanked")
    return 0


def yank_far(options: argparse.Namespace) -> int:
    """Take a version off offer."""
    _replace(options, lambda standing: standing.without(options.name, options.version))
    print(f"{options.name} {options.version} is off offer")
    return 0


def renew_far(options: argparse.Namespace) -> int:
    """Sign the list that is on offer for longer."""
    publisher, follows = _replace(options, lambda standing: standing.renewed())
    print(f"the list of {publisher} is good until {follows.expires:%F}")
    return 0


def _replace(options: argparse.Namespace, change: Callable[[Standing], Targets]) -> tuple[str, Targets]:
    """Put a signed list in place of the publisher's; gives the publisher and the list."""
    remote, ring = remote_of(options), ring_of(folder_of(options))
    publisher = publisher_of(ring, options.publisher)

    async def replace(store: RemoteStore) -> Targets:
        standing = await store.standing(publisher)
        follows = change(standing)
        await store.replace(signed(follows, signer_of(ring, standing)))
        return follows

    return publisher, with_store(remote, replace)


def about(manifest: Manifest, publisher: str) -> list[str]:
    """What a RApp says of itself, in lines for the terminal."""
    asked = {**{f"keywords, {key}": value for key, value in manifest.keywords.items()}}
    asked |= {f"sentences, {key}": value for key, value in manifest.sentences.items()}
    needs = [*(manifest.needs.robot or ("any robot",)), f"API {manifest.needs.api}"]
    facts = {
        "about": (manifest.description,),
        "author": (manifest.author or "unknown",),
        "publisher": (publisher,),
        "agent": (manifest.agent,),
        "needs": needs,
        "may use": (*manifest.permissions.core, *manifest.permissions.cloud),
        "partner": (manifest.partner,) if manifest.partner else (),
        **asked,
    }
    return [manifest.name, *(f"  {name}: {', '.join(value)}" for name, value in facts.items() if value)]


def _names(standing: Standing) -> list[str]:
    return [package_of(path) for path in standing.role.paths or ()]
