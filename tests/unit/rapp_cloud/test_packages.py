"""The index of packages: read once by whichever process, believed only while a file is as it was, never in the way."""

import os
from pathlib import Path

import pytest

from fakes.packages import source_folder
from rapp_cloud import packages, shelf
from rapp_cloud.packages import PackageFiles
from rapp_cloud.shelf import Shelf
from rapp_hop.errors import Bug, Invalid
from rapp_hop.hz import archive
from rapp_hop.hz.archive import build

NAMES = ["first", "second", "third"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.create()
    for name in NAMES:
        shelf.publish(build(source_folder(tmp_path, name)))
    return tmp_path


def names(folder: Path) -> list[str]:
    """The RApps as a process that has just begun sees them."""
    return [manifest.name for manifest in Shelf(folder / "tuf", folder / "keys").manifests()]


def index(folder: Path) -> Path:
    return folder / "cache" / "packages.jsonl"


@pytest.fixture
def inspected(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Packages that were opened."""
    found: list[str] = []
    read = PackageFiles.read

    def noted(self: PackageFiles, target, how):
        found.append(target.path)
        return read(self, target, how)

    monkeypatch.setattr(PackageFiles, "read", noted)
    return found


def test_each_package_is_opened_by_one_process_only(folder: Path, inspected: list[str]) -> None:
    assert names(folder) == NAMES
    assert len(inspected) == 3
    assert names(folder) == NAMES
    assert len(inspected) == 3
    Shelf(folder / "tuf", folder / "keys").publish(build(source_folder(folder, "zero")))
    assert names(folder) == [*NAMES, "zero"]
    assert inspected[3:] == ["zero-1.0.0.hz"]


def test_what_the_index_says_is_the_whole_manifest(folder: Path) -> None:
    first = Shelf(folder / "tuf", folder / "keys").manifests()
    assert Shelf(folder / "tuf", folder / "keys").manifests() == first


@pytest.mark.parametrize("change", ["other bytes", "gone"])
def test_a_package_that_was_changed_is_noticed(folder: Path, change: str) -> None:
    names(folder)
    path = next((folder / "tuf" / "targets").glob("*.second-*"))
    if change == "gone":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:-1] + b"?")
        os.utime(path, ns=(1, 1))
    with pytest.raises(Bug, match="backup"):
        names(folder)


@pytest.mark.parametrize("spoilt", [b"", b"\x00\xff" * 40, b"[]\n{}\n[1,2]\nnull\n5\n[[],1,2,3,4]\n", None])
def test_a_spoilt_index_is_made_up_for(folder: Path, spoilt: bytes | None, inspected: list[str]) -> None:
    names(folder)
    index(folder).write_bytes(index(folder).read_bytes()[:-40] if spoilt is None else spoilt)
    inspected.clear()
    assert names(folder) == NAMES
    assert len(inspected) == (1 if spoilt is None else 3)
    assert names(folder) == NAMES
    assert len(inspected) == (1 if spoilt is None else 3)


def test_an_index_of_lines_that_count_no_more_is_written_anew(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names(folder)
    size = index(folder).stat().st_size
    monkeypatch.setattr(packages, "_SPARE", 0)
    index(folder).write_bytes(index(folder).read_bytes() * 5)
    assert names(folder) == NAMES
    assert index(folder).stat().st_size <= size


def test_lines_of_another_version_of_the_platform_do_not_count(
    folder: Path, monkeypatch: pytest.MonkeyPatch, inspected: list[str]
) -> None:
    names(folder)
    monkeypatch.setattr(packages, "_FORMAT", packages._FORMAT + 1)
    assert names(folder) == NAMES
    assert len(inspected) == 6
    assert {"Manifest.name", "Permissions.core", "Needs.api"} <= set(packages._FIELDS)


def test_a_manifest_that_the_index_cannot_hold_keeps_nobody_from_starting(
    folder: Path, monkeypatch: pytest.MonkeyPatch, inspected: list[str]
) -> None:
    assert names(folder) == NAMES
    source = source_folder(folder, "huge", parameters={"most": 2**64})
    with pytest.raises(Invalid, match="more than 64 bits"):
        build(source)
    with monkeypatch.context() as before:  # a platform that did not look
        for module in (archive, shelf):
            before.setattr(module, "check_numbers", lambda _manifest: None)
        package = build(source)
        Shelf(folder / "tuf", folder / "keys").publish(package)
    assert names(folder) == names(folder) == ["first", "huge", "second", "third"]
    assert inspected.count("huge-1.0.0.hz") == 2 and inspected.count("first-1.0.0.hz") == 1
    with pytest.raises(Invalid, match="more than 64 bits"):
        Shelf(folder / "tuf", folder / "keys").publish(package)


def test_where_the_index_cannot_be_written_packages_are_read_again(folder: Path) -> None:
    index(folder).mkdir(parents=True)
    assert names(folder) == NAMES
    assert names(folder) == NAMES
