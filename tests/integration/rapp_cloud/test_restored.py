"""A platform that came back out of a back-up: robots that saw it when it was newer believe it, and install from it."""

import asyncio
import shutil
import tarfile
from datetime import timedelta
from pathlib import Path

import pytest

from fakes.packages import source_folder
from fakes.power import cut_after
from fakes.publisher import Publisher
from fakes.store_client import StoreClient
from rapp_cli.__main__ import main as rapp
from rapp_cloud.app import open_shelf
from rapp_cloud.backup import Restored, back_up, passphrase_of, restore
from rapp_cloud.custody import _ROOTS
from rapp_cloud.keys import ROLES, Passphrase
from rapp_cloud.shelf import Shelf
from rapp_hop.hz.archive import build
from rapp_hop.hz.delivery import Delivery
from rapp_hop.hz.install import Installed
from rapp_hop.hz.trust import Attack, Untrusted


class _Home:
    """A platform with hello and clock, its back-up, and a robot that goes on with whatever platform is there."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.cloud, self.again, self.file = folder, folder / "cloud", folder / "again", folder / "backup"
        self.cloud.mkdir()
        self.shelf = open_shelf(self.cloud)
        self.shelf.create()
        for name in ("hello", "clock"):
            self.publish(self.shelf, name, "1.0.0")
        back_up(self.cloud, None, self.file)
        self._root = self.shelf.root_file.read_bytes()

    def publish(self, shelf: Shelf, name: str, version: str) -> None:
        shutil.rmtree(self.folder / "source", ignore_errors=True)
        shelf.publish(build(source_folder(self.folder / "source", name, version, keywords={"en": [name]})))

    def robot_gets(self, platform: Path, name: str, robot: str = "robot") -> Installed:
        return asyncio.run(Delivery(StoreClient(platform / "tuf"), self._root, self.folder / robot).install(name))

    def restore(self) -> Restored:
        shutil.rmtree(self.again, ignore_errors=True)
        return restore(self.again, None, self.file)


@pytest.fixture
def home(tmp_path: Path) -> _Home:
    return _Home(tmp_path)


def test_what_was_published_after_the_back_up_stays_on_its_robot_until_a_newer_one_comes(home: _Home) -> None:
    home.publish(home.shelf, "hello", "1.2.0")
    assert home.robot_gets(home.cloud, "hello").version == "1.2.0"
    done = home.restore()
    assert (done.left, done.expired) == ("", [])
    kept = home.robot_gets(home.again, "hello")
    assert (kept.version, kept.new) == ("1.2.0", False)
    assert home.robot_gets(home.again, "clock").new
    assert home.robot_gets(home.again, "hello", "a new robot").version == "1.0.0"
    home.publish(open_shelf(home.again), "hello", "1.3.0")
    assert home.robot_gets(home.again, "hello").version == "1.3.0"


def test_a_robot_goes_back_behind_what_is_yanked_after_a_restore(home: _Home) -> None:
    home.restore()
    shelf = open_shelf(home.again)
    home.publish(shelf, "hello", "1.1.0")
    assert home.robot_gets(home.again, "hello").version == "1.1.0"
    shelf.yank("hello", "1.1.0")
    assert home.robot_gets(home.again, "hello").version == "1.0.0"


@pytest.mark.parametrize("rotated", [("timestamp", "snapshot"), ROLES[1:] * 2, ("rapp",)])
def test_keys_that_were_rotated_after_the_back_up(home: _Home, rotated: tuple[str, ...]) -> None:
    for role in rotated:
        home.shelf.custody.rotate(role)
    for _ in range(30):
        home.shelf.refresh()
    home.robot_gets(home.cloud, "hello")
    home.restore()
    assert home.robot_gets(home.again, "clock").new


def test_a_robot_that_saw_too_many_roots_follows_when_it_is_done_again(home: _Home, capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(_ROOTS):
        home.shelf.custody.rotate("timestamp")
    home.robot_gets(home.cloud, "hello")
    home.restore()
    with pytest.raises(Untrusted) as caught:
        home.robot_gets(home.again, "hello")
    assert caught.value.attack == Attack.UNSIGNED
    assert rapp(["keys", "resume", "--data", str(home.again)]) == 0
    assert "robots believe this store" in capsys.readouterr().out
    assert home.robot_gets(home.again, "clock").new


def test_a_key_that_is_kept_elsewhere_is_asked_for(home: _Home, capsys: pytest.CaptureFixture[str]) -> None:
    home.shelf.refresh()
    home.robot_gets(home.cloud, "hello")
    root = home.cloud / "keys" / "root.pem"
    root.rename(home.folder / "root.pem")
    home.file.unlink()
    back_up(home.cloud, None, home.file)
    home.shelf.refresh()
    home.robot_gets(home.cloud, "hello")
    assert rapp(["cloud", "--data", str(home.again), "restore", str(home.file)]) == 1
    told = capsys.readouterr().err
    assert "cannot sign as root" in told and "./rapp keys resume" in told
    with pytest.raises(Untrusted):
        home.robot_gets(home.again, "clock")
    assert rapp(["keys", "resume", "--data", str(home.again)]) == 1
    shutil.copy(home.folder / "root.pem", home.again / "keys")
    assert rapp(["keys", "resume", "--data", str(home.again)]) == 0
    assert home.robot_gets(home.again, "clock").new


def test_a_publisher_elsewhere_whose_list_has_expired_is_named(home: _Home) -> None:
    maria = Publisher("maria", home.shelf, home.folder)
    maria.join("lamp")
    data = build(source_folder(home.folder / "lamp", "lamp", keywords={"en": ["lamp"]}, sentences={"en": ["light please"]}))
    home.shelf.desk.publish("maria", maria.file(data), maria.list_with(data), lambda *_: None, 2**20)
    late = home.shelf.custody._ledger
    lists = late.read()
    lists.publishers["maria"].expires -= timedelta(days=400)
    lists.publishers["maria"].version += 1
    late.write(lists, (), {"maria": maria.signed(lists.publishers["maria"])})
    back_up(home.cloud, None, home.file)
    assert home.restore().expired == ["lamp-1.0.0 of maria"]
    assert home.robot_gets(home.again, "hello").new
    with pytest.raises(Untrusted):
        home.robot_gets(home.again, "lamp")


def test_the_power_goes_while_robots_are_to_believe_it_again(home: _Home) -> None:
    home.shelf.refresh()
    home.robot_gets(home.cloud, "hello")
    home.restore()
    for writes in range(0, 18, 3):
        shelf = open_shelf(home.again)
        cut_after(writes, shelf.custody.resume)
        shelf.refresh()
        shelf.custody.resume()
        assert home.robot_gets(home.again, "hello", f"robot {writes}").version == "1.0.0"
        home.robot_gets(home.again, "hello")


def _held(file: Path) -> bytes:
    """All that is in a back-up."""
    with tarfile.open(file) as archive:
        return b"".join(body.read() for member in archive if (body := archive.extractfile(member)))


def test_a_back_up_alone_opens_no_key(home: _Home, capsys: pytest.CaptureFixture[str]) -> None:
    word = passphrase_of(home.file)
    secret = (home.cloud / "keys" / "passphrase").read_bytes()
    assert secret not in _held(home.file)
    assert (word.read_bytes(), word.stat().st_mode & 0o777) == (secret, 0o600)
    away = word.rename(home.folder / "away")
    assert rapp(["cloud", "--data", str(home.again), "restore", str(home.file)]) == 1
    told = capsys.readouterr().err
    assert "cannot read the passphrase" in told and "RAPP_CLOUD_PASSPHRASE_FILE" in told and "./rapp keys resume" in told
    away.rename(home.again / "keys" / "passphrase")
    assert rapp(["keys", "resume", "--data", str(home.again)]) == 0
    assert home.robot_gets(home.again, "hello").new


def test_a_passphrase_of_the_owner_s_stays_out_wherever_its_file_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cloud, again, file = tmp_path / "cloud", tmp_path / "again", tmp_path / "backup"
    word = cloud / "keys" / "word"
    word.parent.mkdir(parents=True)
    word.write_text("correct horse battery staple")
    word.chmod(0o600)
    open_shelf(cloud, Passphrase(file=word)).create()
    monkeypatch.setenv("RAPP_CLOUD_PASSPHRASE_FILE", str(word))
    assert rapp(["cloud", "--data", str(cloud), "backup", str(file)]) == 0
    assert b"correct horse" not in _held(file)
    assert not passphrase_of(file).exists()
    assert rapp(["cloud", "--data", str(again), "restore", str(file)]) == 0
    assert not (again / "keys" / "passphrase").exists()
    monkeypatch.delenv("RAPP_CLOUD_PASSPHRASE_FILE")
    assert restore(tmp_path / "third", None, file).left.startswith("cannot read the passphrase")
