"""Publishers elsewhere: what they hand in is on offer as they have signed it, or nothing has changed."""

import os
import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from securesystemslib.signer import CryptoSigner

from fakes.packages import packed, right_members, source_folder
from fakes.publisher import Publisher
from fakes.store_folder import StoreFolder
from rapp_cloud.desk import Desk
from rapp_cloud.shelf import Shelf
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.hz.application import first_list
from rapp_hop.hz.archive import build, inspect
from rapp_hop.hz.standing import signed
from rapp_hop.hz.tar import Limits
from rapp_hop.hz.trust import Attack, TrustedStore, Untrusted, Versions

QUOTA = 2**20


def package(folder: Path, name: str = "clock", version: str = "1.0.0", program: str = "pass\n", **rapp: Any) -> bytes:
    shutil.rmtree(folder / "source", ignore_errors=True)
    words = {"keywords": {"en": [name]}, "sentences": {"en": [f"start {name}"]}, **rapp}
    return build(source_folder(folder / "source", name, version, program, **words))


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.create()
    shelf.publish(package(tmp_path, "hello"))
    return shelf


@pytest.fixture
def maria(shelf: Shelf, tmp_path: Path) -> Publisher:
    maria = Publisher("maria", shelf, tmp_path)
    maria.join("clock", "lamp")
    return maria


@pytest.fixture
def robot(shelf: Shelf, tmp_path: Path) -> TrustedStore:
    return TrustedStore(StoreFolder(tmp_path / "tuf"), "store:", shelf.root_file.read_bytes(), tmp_path / "robot")


def hand_in(shelf: Shelf, who: Publisher, data: bytes, signed_list: bytes | None = None, **words: Any) -> list[tuple[str, str]]:
    noted: list[tuple[str, str]] = []
    given = {"quota": QUOTA, **words}
    shelf.desk.publish(who.name, who.file(data), signed_list or who.list_with(data), lambda *deed: noted.append(deed), **given)
    return noted


def replace(shelf: Shelf, who: Publisher, signed_list: bytes, quota: int = QUOTA) -> list[tuple[str, str]]:
    noted: list[tuple[str, str]] = []
    shelf.desk.replace(who.name, signed_list, lambda *deed: noted.append(deed), quota)
    return noted


def offered(robot: TrustedStore, name: str = "clock") -> list[str]:
    return [release.version.text for release in robot.versions(name).releases]


def state(shelf: Shelf) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in shelf.metadata.parent.rglob("*") if path.is_file()}


def test_what_is_handed_in_arrives_verified(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path) -> None:
    data = package(tmp_path)
    assert offered(robot) == []
    assert hand_in(shelf, maria, data) == [("publish", "clock 1.0.0")]
    (release,) = robot.versions("clock").releases
    robot.download(release, tmp_path / "got.hz")
    assert (tmp_path / "got.hz").read_bytes() == data
    assert [(offer.manifest.name, offer.publisher) for offer in shelf.offers()] == [("clock", "maria"), ("hello", "rapp")]
    assert not (tmp_path / "keys" / "maria.pem").exists()
    hand_in(shelf, maria, package(tmp_path, version="1.1.0"))
    shelf.refresh()
    assert replace(shelf, maria, maria.signed(maria.standing.without("clock", "1.0.0"))) == [("yank", "clock 1.0.0")]
    assert robot.versions("clock") == Versions(robot.versions("clock").releases, frozenset({"1.0.0"}))
    assert offered(robot) == ["1.1.0"]
    with pytest.raises(Refused, match="other bytes"):
        maria.list_with(package(tmp_path, program="evil()\n"))
    assert replace(shelf, maria, maria.signed(maria.standing.renewed())) == [("renew", "list 5")]
    assert offered(robot) == ["1.1.0"]
    with pytest.raises(Refused, match=r"maria\.pem is not in .* who has it signs with --cloud"):
        shelf.yank("clock", "1.1.0")


def test_a_package_of_some_robots_only(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path) -> None:
    data = package(tmp_path)
    hand_in(shelf, maria, data, maria.list_with(data, ("nao1",)))
    assert robot.versions("clock").releases[0].robots == ("nao1",)


def test_two_at_once_and_the_second_runs_it_again(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path) -> None:
    clock, lamp = package(tmp_path), package(tmp_path, "lamp")
    first, second = maria.list_with(clock), maria.list_with(lamp)
    hand_in(shelf, maria, clock, first)
    with pytest.raises(Refused, match="somebody published meanwhile; run it again"):
        hand_in(shelf, maria, lamp, second)
    hand_in(shelf, maria, lamp)
    assert (offered(robot), offered(robot, "lamp")) == (["1.0.0"], ["1.0.0"])


def test_only_looked_at(shelf: Shelf, maria: Publisher, tmp_path: Path) -> None:
    before = state(shelf)
    assert hand_in(shelf, maria, package(tmp_path), check=True) == []
    assert state(shelf) == before


def test_what_is_not_noted_is_not_on_offer(shelf: Shelf, maria: Publisher, tmp_path: Path) -> None:
    before, data = state(shelf), package(tmp_path)

    def away(deed: str, subject: str) -> None:
        raise Unreachable("cannot reach the database")

    with pytest.raises(Unreachable):
        shelf.desk.publish("maria", maria.file(data), maria.list_with(data), away, QUOTA)
    with pytest.raises(Unreachable):
        shelf.desk.replace("maria", maria.signed(maria.standing.renewed()), away, QUOTA)
    assert state(shelf) == before


def refused(shelf: Shelf, who: Publisher, data: bytes, signed_list: bytes | None = None, **words: Any) -> HopError:
    before = state(shelf)
    with pytest.raises(HopError) as caught:
        hand_in(shelf, who, data, signed_list, **words)
    assert state(shelf) == before
    return caught.value


def test_packages_that_are_not_those_of_the_list(shelf: Shelf, maria: Publisher, tmp_path: Path) -> None:
    right, longer = package(tmp_path), package(tmp_path, program="print('other')\n")
    other = package(tmp_path, "lamp")
    listed = maria.list_with(right)
    assert "another length or hash" in str(refused(shelf, maria, longer, listed))
    assert "the list is for clock-1.0.0.hz" in str(refused(shelf, maria, other, listed))
    assert "this one package more" in str(refused(shelf, maria, right, maria.signed(maria.standing.renewed())))
    assert isinstance(refused(shelf, maria, right[:-9], listed), Invalid)
    assert isinstance(refused(shelf, maria, b"no package", listed), Invalid)
    hand_in(shelf, maria, right)
    newer = package(tmp_path, version="1.1.0")
    both = maria.standing.without("clock", "1.0.0")
    both.targets |= {path: target for path, target in _next(maria, newer).items() if path.startswith("clock-1.1")}
    assert "all that were there" in str(refused(shelf, maria, newer, maria.signed(both)))
    before = state(shelf)
    with pytest.raises(Invalid, match="must come with it"):
        replace(shelf, maria, maria.list_with(newer))
    assert state(shelf) == before


def _next(who: Publisher, data: bytes) -> dict[str, Any]:
    with who.file(data).open("rb") as file:
        follows = who.standing.with_package(inspect(file).manifest, data)
    assert follows is not None
    return follows.targets


def test_packages_as_the_store_takes_them_from_nobody(shelf: Shelf, maria: Publisher, tmp_path: Path) -> None:
    assert "is what one says for hello" in str(refused(shelf, maria, package(tmp_path, keywords={"en": ["Hello!"]})))
    assert "nobody could ask for it" in str(refused(shelf, maria, package(tmp_path, keywords={}, sentences={})))
    assert "publish its cloud agent" in str(refused(shelf, maria, package(tmp_path, partner="clock_cloud")))
    hand_in(shelf, maria, package(tmp_path, version="2.0.0"))
    assert "2.0.0 is on offer, raise its version" in str(refused(shelf, maria, package(tmp_path, version="1.0.0")))
    bare = packed(right_members("lamp")).getvalue()
    assert "no etc/weblet.info" in str(refused(shelf, maria, bare))


def test_too_much(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path) -> None:
    data, newer = package(tmp_path), package(tmp_path, version="1.1.0")
    free = (lambda *_: None, QUOTA)

    def used() -> int:
        lists, packages = shelf.metadata.glob("*.maria.json"), shelf.targets.glob("*.clock-*.hz")
        return sum(path.stat().st_size for path in (*lists, *packages))

    exact = used() + len(data) + len(maria.list_with(data))
    assert f"{exact - 1} are allowed" in str(refused(shelf, maria, data, quota=exact - 1))
    hand_in(shelf, maria, data, quota=exact)
    with pytest.raises(Refused, match=r"cannot take the list: .* ask who keeps the platform"):
        replace(shelf, maria, maria.signed(maria.standing.renewed()), quota=exact)
    replace(shelf, maria, maria.signed(maria.standing.without("clock", "1.0.0")), quota=0)
    exact = used() + len(newer) + len(maria.list_with(newer))
    assert refused(shelf, maria, newer, quota=exact - 1).status == 413
    hand_in(shelf, maria, newer, quota=exact)
    small = Desk(shelf._ledger, shelf.targets, Limits(packed=100), shelf.manifests)
    with pytest.raises(Refused, match="not signed by maria's key"):  # before anybody looks at the package
        small.publish("maria", maria.file(newer), signed(maria.standing.renewed(), CryptoSigner.generate_ed25519()), *free)
    newest = package(tmp_path, version="1.2.0")
    with pytest.raises(Invalid, match="100"):
        small.publish("maria", maria.file(newest), maria.list_with(newest), *free)


def test_one_cannot_touch_what_is_anothers(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path) -> None:
    eve = Publisher("eve", shelf, tmp_path)
    eve.join("parrot")
    hand_in(shelf, maria, package(tmp_path))
    with pytest.raises(Refused, match="the name is not theirs"):
        eve.list_with(package(tmp_path, "clock", "9.0.0"))
    with pytest.raises(Refused, match="eve has none on offer"):
        eve.standing.without("clock", "1.0.0")
    wanted, theirs = package(tmp_path, "clock", "9.0.0"), maria.standing.renewed()
    theirs.targets |= _next(maria, wanted)
    for at_the_desk, signer in ((eve, eve), (maria, eve), (eve, maria)):
        error = refused(shelf, at_the_desk, wanted, signer.signed(theirs))
        assert isinstance(error, Refused) and error.status == (409 if at_the_desk is signer else 403)
    with pytest.raises(Refused, match=r"it is maria's, choose another name"):
        shelf.custody.grant("eve", ["clock"])
    with pytest.raises(Refused, match=r"they have no key"):
        shelf.custody.grant("nobody", ["clock"])
    assert offered(robot) == ["1.0.0"]


def test_keys_that_are_known_no_more(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path) -> None:
    data, newer = package(tmp_path), package(tmp_path, version="1.1.0")
    stranger = maria.list_with(data)
    maria.key, right = CryptoSigner.generate_ed25519(), maria.key
    assert refused(shelf, maria, data, maria.list_with(data)).status == 403
    maria.key = right
    hand_in(shelf, maria, data, stranger)
    signed_before = maria.list_with(newer)
    more = {path: target for path, target in _next(maria, newer).items() if path.startswith("clock-1.1")}
    shelf.custody.revoke("maria")
    error = refused(shelf, maria, newer, signed_before)
    assert "the store knows no key of theirs" in str(error)
    assert offered(robot) == []
    with pytest.raises(Refused, match="it was revoked"):
        shelf.custody.add("maria", maria.application(first_list(2)))
    maria.key = CryptoSigner.generate_ed25519()
    with pytest.raises(Refused, match=r"3 comes next, have them run ./rapp keys own maria --after 2"):
        shelf.custody.add("maria", maria.application())
    with pytest.raises(Refused, match="it must be empty"):
        full = first_list(2)
        full.targets.update(more)
        shelf.custody.add("maria", maria.application(full))
    shelf.custody.add("maria", maria.application(first_list(2)))
    assert offered(robot) == []
    with pytest.raises(Refused, match="other bytes"):
        maria.list_with(package(tmp_path, program="evil()\n"))
    forgetful = maria.standing.renewed()
    forgetful.unrecognized_fields.clear()
    with pytest.raises(Refused, match=r"clock-1\.0\.0\.hz is gone"):
        replace(shelf, maria, maria.signed(forgetful))
    hand_in(shelf, maria, newer)
    assert robot.versions("clock").yanked == {"1.0.0"}
    assert offered(robot) == ["1.1.0"]
    shelf.custody.revoke("maria")
    maria.key = CryptoSigner.generate_ed25519()
    shelf.custody.add("maria", maria.application(first_list(4)))
    shelf.custody.revoke("maria")
    shelf.custody.add("maria")  # a key of the platform's, after one that has signed nothing
    with pytest.raises(Refused, match="other bytes"):
        shelf.publish(package(tmp_path, program="evil()\n"))
    assert robot.versions("clock").yanked == {"1.0.0", "1.1.0"}


def test_another_key_takes_over_what_is_on_offer(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path) -> None:
    hand_in(shelf, maria, package(tmp_path))
    old, maria.key = maria.key, CryptoSigner.generate_ed25519()
    with pytest.raises(Refused, match="must have the packages on offer"):
        shelf.custody.rotate("maria", maria.application(maria.standing.without("clock", "1.0.0")))
    shelf.custody.rotate("maria", maria.application(maria.standing.renewed()))
    assert offered(robot) == ["1.0.0"]
    hand_in(shelf, maria, package(tmp_path, version="1.1.0"))
    assert offered(robot) == ["1.0.0", "1.1.0"]
    maria.key = old
    assert refused(shelf, maria, package(tmp_path, version="1.2.0")).status == 403
    with pytest.raises(Refused, match=r"maria\.pem is not in"):
        shelf.custody.rotate("maria")


def test_a_publisher_of_the_platform_takes_their_key_home(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    rapp = Publisher("rapp", shelf, tmp_path)
    shelf.custody.rotate("rapp", rapp.application(rapp.standing.renewed()))
    assert not (tmp_path / "keys" / "rapp.pem").exists()
    assert offered(robot, "hello") == ["1.0.0"]
    hand_in(shelf, rapp, package(tmp_path, "hello", "1.1.0"))
    assert offered(robot, "hello") == ["1.0.0", "1.1.0"]


def test_applications_that_are_not_taken(shelf: Shelf, maria: Publisher, tmp_path: Path) -> None:
    eve = Publisher("eve", shelf, tmp_path)
    full = first_list()
    full.targets.update(_next(maria, package(tmp_path)))
    with pytest.raises(Refused, match="cannot publish clock as eve"):
        shelf.custody.add("eve", eve.application(full))
    with pytest.raises(Refused, match="is taken"):
        shelf.custody.add("maria", maria.application())
    for name in ("eve", "targets"):
        with pytest.raises(Refused, match="that is no publisher"):
            shelf.custody.rotate(name, eve.application())
    assert [holder.name for holder in shelf.custody.publishers()] == ["maria", "rapp"]


def test_nothing_is_signed_for_a_store_that_went_back(shelf: Shelf, maria: Publisher, tmp_path: Path) -> None:
    hand_in(shelf, maria, package(tmp_path))
    shutil.copytree(shelf.metadata, tmp_path / "old")
    hand_in(shelf, maria, package(tmp_path, version="1.1.0"))
    assert set(maria.standing.own.targets) == {"clock-1.0.0.hz", "clock-1.1.0.hz"}
    shutil.rmtree(shelf.metadata)
    (tmp_path / "old").rename(shelf.metadata)
    with pytest.raises(Untrusted) as caught:
        maria.list_with(package(tmp_path, version="1.2.0"))
    assert caught.value.attack == Attack.ROLLBACK


def test_the_platform_needs_no_key_that_publishes(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path) -> None:
    for name in ("root", "targets", "rapp"):
        (tmp_path / "keys" / f"{name}.pem").rename(tmp_path / f"{name}.pem")
    hand_in(shelf, maria, package(tmp_path))
    shelf.refresh()
    assert offered(robot) == ["1.0.0"]


def test_a_list_that_has_expired_is_followed_by_another(
    shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path
) -> None:
    eve = Publisher("eve", shelf, tmp_path)
    eve.join("parrot")
    hand_in(shelf, maria, package(tmp_path))
    gone = maria.standing.renewed()
    gone.expires = datetime.now(UTC) - timedelta(days=1)
    lists = shelf._ledger.read()
    lists.publishers["maria"] = gone
    shelf._ledger.write(lists, (), {"maria": maria.signed(gone)})
    with pytest.raises(Untrusted, match="freeze"):
        offered(robot)
    assert [standing.publisher for standing in robot.standings()] == ["rapp", "maria", "eve"]
    path = shelf.metadata / f"{gone.version}.maria.json"
    right = path.read_bytes()
    path.write_bytes(right.replace(b'"version":3', b'"version":4'))
    with pytest.raises(Untrusted):
        robot.standings("maria")
    path.write_bytes(right)
    replace(shelf, maria, maria.signed(maria.standing.renewed()))
    assert offered(robot) == ["1.0.0"]


@pytest.mark.parametrize("resumed", [False, True], ids=["in a row", "numbered anew"])
def test_lists_of_old_go(shelf: Shelf, maria: Publisher, robot: TrustedStore, tmp_path: Path, resumed: bool) -> None:
    for version in ("1.0.0", "1.1.0"):
        hand_in(shelf, maria, package(tmp_path, version=version))
    if resumed:
        shelf.custody.resume()
    before = {path.name for path in shelf.metadata.iterdir()}
    shelf.refresh()
    assert {path.name for path in shelf.metadata.iterdir()} == before  # robots may still look at them
    for path in shelf.metadata.iterdir():
        os.utime(path, times=(0, 0))
    shelf.refresh()
    newest = shelf._ledger.read()
    lists = {"snapshot": newest.snapshot, "targets": newest.targets, **newest.publishers}
    wanted = {f"{one.version}.{name}.json" for name, one in lists.items()}
    wanted |= {f"{number}.root.json" for number in range(1, newest.root.version + 1)}
    assert {path.name for path in shelf.metadata.iterdir()} == {*wanted, "timestamp.json"}
    assert offered(robot) == ["1.0.0", "1.1.0"]
