"""A root of several keys: robots follow what enough of them have signed, and one lost or stolen does not end the store."""

from pathlib import Path

import pytest

from fakes.power import Kept, cut_after
from fakes.small_store import offered, package, robot_of, shelf_with_hello
from rapp_cloud.shelf import Shelf
from rapp_hop.errors import Refused
from rapp_hop.hz.trust import Attack, TrustedStore, Untrusted


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    return shelf_with_hello(tmp_path)


@pytest.fixture
def robot(shelf: Shelf, tmp_path: Path) -> TrustedStore:
    return robot_of(shelf, tmp_path, "trust")


def test_a_root_of_three_keys_outlives_one_of_them(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    assert offered(robot) == ["1.0.0"]
    shelf.custody.share_root(3, 2)
    (root, *_) = shelf.custody.holders()
    assert (len(root.keys), root.threshold, root.here) == (3, 2, True)
    (tmp_path / "keys" / "root_2.pem").unlink()  # lost
    for number, role in enumerate(("targets", "root"), 1):
        shelf.custody.rotate(role)
        shelf.publish(package(tmp_path, version=f"1.0.{number}"))
    assert offered(robot) == ["1.0.0", "1.0.1", "1.0.2"]
    assert len(set(shelf.custody.holders()[0].keys) - set(root.keys)) == 3
    shelf.custody.share_root(1, 1)
    assert not list((tmp_path / "keys").glob("root_*.pem"))
    newcomer = robot_of(shelf, tmp_path, "new")
    assert offered(newcomer) == offered(robot)


def test_one_of_three_root_keys_changes_nothing(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    shelf.custody.share_root(3, 2)
    assert offered(robot) == ["1.0.0"]
    before = Kept(tmp_path)
    thief = shelf._keys.signer("root_3")
    for name in ("root", "root_2"):
        (tmp_path / "keys" / f"{name}.pem").unlink()
    assert not shelf.custody.holders()[0].here
    for change in (
        lambda: shelf.custody.rotate("root"),
        lambda: shelf.custody.rotate("targets"),
        lambda: shelf.custody.share_root(1, 1),
    ):
        with pytest.raises(Refused, match=r"1 of the 3 keys that robots believe .*, 2 must sign"):
            change()
    shelf.refresh()  # what needs no root goes on
    shelf.publish(package(tmp_path, version="1.1.0"))
    assert offered(robot) == ["1.0.0", "1.1.0"]
    before.again()
    root, own = shelf._ledger.read().root, shelf._keys.new("root")
    for keyid in list(root.roles["root"].keyids):
        root.revoke_key(keyid, "root")
    root.add_key(own.public_key, "root")
    root.roles["root"].threshold = 1
    root.version += 1
    shelf._ledger.write_root(root, [thief, own])
    with pytest.raises(Untrusted) as refused:
        offered(robot)
    assert refused.value.attack is Attack.UNSIGNED


def test_a_root_shared_out_while_the_power_goes_loses_no_key(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    before = Kept(tmp_path)
    for writes in range(9):
        before.again()
        cut_after(writes, lambda: shelf.custody.share_root(3, 2))
        shelf.refresh()
        shelf.publish(package(tmp_path, version="1.1.0"))
        shelf.custody.rotate("root")
        assert offered(robot) == ["1.0.0", "1.1.0"], f"after {writes} writes"


@pytest.mark.parametrize(("keys", "threshold"), [(3, 4), (3, 0), (0, 0), (10, 2)])
def test_numbers_of_root_keys_that_make_no_sense(shelf: Shelf, keys: int, threshold: int) -> None:
    with pytest.raises(Refused, match=f"cannot have {threshold} of {keys} keys sign"):
        shelf.custody.share_root(keys, threshold)
    with pytest.raises(Refused, match="the name is taken"):
        shelf.custody.add("root_2")
