"""Installed RApps appear whole or not at all; the version before stays."""

import os
import shutil
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import source_folder
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.archive import build
from rapp_hop.hz.install import PackageFile, RappFolder, install
from rapp_hop.hz.manifest import Manifest
from rapp_hop.hz.tar import Limits


def package(folder: Path, version: str, name: str = "hello", says: str | None = None) -> PackageFile:
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}-{version}.hz"
    shutil.rmtree(folder / "src", ignore_errors=True)
    path.write_bytes(build(source_folder(folder / "src", name, version, f"print({version!r})\n")))
    return PackageFile(path, name, says or version, Limits())


@dataclass
class Failing:
    """A source that stops in the middle, as a full disk would."""

    name: str = "hello"
    version: str = "1.1.0"

    def unpack(self, folder: Path) -> Manifest:
        folder.mkdir()
        (folder / "agent.py").write_text("half")
        raise OSError(28, "No space left on device")


@pytest.fixture
def rapps(tmp_path: Path) -> RappFolder:
    return RappFolder(tmp_path / "rapps")


def test_install_find_list_remove(rapps: RappFolder, tmp_path: Path) -> None:
    done = install(package(tmp_path, "1.0.0"), rapps)
    assert done.new
    assert done.path == tmp_path / "rapps" / "hello" / "1.0.0"
    assert (tmp_path / "rapps" / "hello" / "current" / "agent.py").read_text() == "print('1.0.0')\n"
    assert rapps.list()["hello"].version.text == "1.0.0"
    assert rapps.remove("hello")
    assert not rapps.remove("hello")
    assert rapps.find("hello") is None
    assert rapps.list() == {}


def test_again_is_not_new(rapps: RappFolder, tmp_path: Path) -> None:
    source = package(tmp_path, "1.0.0")
    assert install(source, rapps).new
    assert not install(source, rapps).new


def versions(rapps: RappFolder) -> list[str]:
    return sorted(path.name for path in (rapps.root / "hello").iterdir() if not path.is_symlink())


def test_the_version_before_stays_until_the_new_one_has_started(rapps: RappFolder, tmp_path: Path) -> None:
    for version in ("1.0.0", "1.1.0"):
        install(package(tmp_path, version), rapps)
    assert not rapps.settle("hello", "1.0.0")
    assert versions(rapps) == ["1.0.0", "1.1.0"]
    assert rapps.settle("hello", "1.1.0")
    assert versions(rapps) == ["1.1.0"]
    assert not rapps.settle("hello", "1.1.0")
    with pytest.raises(Refused, match="no version before"):
        rapps.go_back("hello")


def test_the_version_gone_back_to_is_the_last_that_has_started(rapps: RappFolder, tmp_path: Path) -> None:
    for version in ("1.0.0", "1.1.0", "1.2.0"):
        install(package(tmp_path, version), rapps)
    assert versions(rapps) == ["1.0.0", "1.2.0"]
    assert rapps.go_back("hello").version == "1.0.0"
    assert versions(rapps) == ["1.0.0"]
    assert rapps.failed("hello") == "1.2.0"
    with pytest.raises(Refused, match="no version before"):
        rapps.go_back("hello")


def test_a_version_that_failed_may_be_installed_again_on_request(rapps: RappFolder, tmp_path: Path) -> None:
    for version in ("1.0.0", "1.1.0"):
        install(package(tmp_path, version), rapps)
    rapps.go_back("hello")
    assert install(package(tmp_path / "again", "1.1.0"), rapps).new
    assert rapps.failed("hello") is None
    assert rapps.find("hello") == rapps.find("hello", "1.1.0")


def test_without_a_version_that_has_started_the_first_one_is_the_one_before(rapps: RappFolder, tmp_path: Path) -> None:
    for version in ("1.0.0", "1.1.0", "1.0.0"):
        install(package(tmp_path / version, version), rapps)
    assert versions(rapps) == ["1.0.0"]
    assert not rapps.settle("hello", "1.0.0")


def test_s17_a_full_disk_leaves_what_was(rapps: RappFolder, tmp_path: Path) -> None:
    install(package(tmp_path, "1.0.0"), rapps)
    with pytest.raises(Refused, match="free some space"):
        install(Failing(), rapps)
    assert rapps.list()["hello"].version.text == "1.0.0"
    assert sorted(path.name for path in rapps.root.iterdir()) == [".lock", "hello"]


def test_p25_the_package_must_be_who_was_asked_for(rapps: RappFolder, tmp_path: Path) -> None:
    with pytest.raises(Invalid, match=r"the package says it is hello 1\.0\.0"):
        install(package(tmp_path, "1.0.0", says="2.0.0"), rapps)
    assert rapps.list() == {}


WRITES = ("mkdir", "open", "fsync", "rename", "replace", "symlink", "unlink", "rmdir")


def install_until_the_power_fails(rapps: RappFolder, source: PackageFile, writes: int) -> bool:
    """Install in a process that is gone, without a farewell, before its write of that number; gives whether it came to its end."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1] == 0
    left = [writes]

    def cut(work: Callable[..., Any]) -> Callable[..., Any]:
        def cut_or_do(*words: Any, **more: Any) -> Any:
            left[0] -= 1
            if left[0] < 0:
                os._exit(9)
            return work(*words, **more)

        return cut_or_do

    for name in WRITES:
        setattr(os, name, cut(getattr(os, name)))
    try:
        install(source, rapps)
    finally:
        os._exit(0)


def test_l08_a_power_cut_at_every_write_leaves_the_version_before_or_the_new_one(rapps: RappFolder, tmp_path: Path) -> None:
    install(package(tmp_path, "1.0.0"), rapps)
    update, before = package(tmp_path, "1.1.0"), tmp_path / "before"
    rapps.root.rename(before)
    seen = set()
    for writes in range(1000):
        shutil.copytree(before, rapps.root, symlinks=True)
        ended = install_until_the_power_fails(rapps, update, writes)
        there = rapps.find("hello")
        assert there is not None
        assert (there.path / "agent.py").read_text() == f"print({there.version!r})\n"
        seen.add(there.version)
        install(update, rapps)
        assert {path.name for path in rapps.root.iterdir()} == {".lock", "hello"}
        assert {path.name for path in (rapps.root / "hello").iterdir()} == {"1.0.0", "1.1.0", "current", "previous"}
        shutil.rmtree(rapps.root)
        if ended:
            break
    assert ended and writes > 10
    assert seen == {"1.0.0", "1.1.0"}


def test_what_a_power_cut_left_is_swept_up(rapps: RappFolder, tmp_path: Path) -> None:
    (tmp_path / "rapps" / ".aside-dead").mkdir(parents=True)
    install(package(tmp_path, "1.0.0"), rapps)
    assert not (tmp_path / "rapps" / ".aside-dead").exists()


def test_names_cannot_lead_out(rapps: RappFolder, tmp_path: Path) -> None:
    (tmp_path / "precious").mkdir()
    for name in ("../precious", "/", ".", "..", ".lock"):
        with pytest.raises(Invalid):
            rapps.remove(name)
        with pytest.raises(Invalid):
            rapps.find(name)
    assert (tmp_path / "precious").is_dir()


def test_s19_two_installations_at_once(rapps: RappFolder, tmp_path: Path) -> None:
    source = package(tmp_path, "1.0.0")
    new: list[bool] = []
    threads = [threading.Thread(target=lambda: new.append(install(source, rapps).new)) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(new) == [False] * 5 + [True]
    assert rapps.find("hello") is not None


def test_a_cloud_agent_is_not_installed(rapps: RappFolder, tmp_path: Path) -> None:
    source = source_folder(tmp_path / "src", "hello", agent="cloud", keywords={}, sentences={}, permissions={})
    (tmp_path / "hello.hz").write_bytes(build(source))
    with pytest.raises(Refused, match="which the platform runs"):
        install(PackageFile(tmp_path / "hello.hz", "hello", "1.0.0", Limits()), rapps)
    assert rapps.find("hello") is None
    assert [path.name for path in rapps.root.iterdir()] == [".lock"]
