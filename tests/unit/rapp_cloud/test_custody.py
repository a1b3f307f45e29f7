"""Keys: made, encrypted, rotated, revoked; publishers keep their names; robots follow or refuse."""

import shutil
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import Metadata, MetaFile, Root, Snapshot, TargetFile, Targets, Timestamp

from fakes.packages import source_folder
from fakes.store_folder import StoreFolder
from rapp_cloud.files import write_whole
from rapp_cloud.keys import ROLES, KeyRing, Passphrase, passphrase_from
from rapp_cloud.ledger import Expiry
from rapp_cloud.shelf import Shelf
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.archive import build
from rapp_hop.hz.trust import Attack, TrustedStore, Untrusted, choose

SECRET = "correct horse battery staple"


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.create()
    shelf.publish(package(tmp_path))
    return shelf


@pytest.fixture
def robot(shelf: Shelf, tmp_path: Path) -> TrustedStore:
    return TrustedStore(StoreFolder(tmp_path / "tuf"), "store:", shelf.root_file.read_bytes(), tmp_path / "trust")


def package(folder: Path, name: str = "hello", version: str = "1.0.0", program: str = "pass\n") -> bytes:
    source = folder / "sources" / program.strip()
    shutil.rmtree(source, ignore_errors=True)
    return build(source_folder(source, name, version, program))


def offered(robot: TrustedStore, name: str = "hello") -> list[str]:
    return [release.version.text for release in robot.versions(name).releases]


def key_of(shelf: Shelf, name: str) -> str:
    (found,) = [holder for holder in shelf.custody.holders() if holder.name == name]
    return found.keys[0]


def test_keys_are_encrypted_with_a_passphrase_of_ours(tmp_path: Path) -> None:
    (tmp_path / "word").write_text(SECRET + "\n")
    (tmp_path / "word").chmod(0o600)
    by_file, by_text = Passphrase(file=tmp_path / "word"), Passphrase(SECRET)
    Shelf(tmp_path / "tuf", tmp_path / "keys", passphrase=by_file).create()
    assert not (tmp_path / "keys" / "passphrase").exists()
    Shelf(tmp_path / "tuf", tmp_path / "keys", passphrase=by_text).refresh()
    with pytest.raises(Refused, match="the passphrase is another"):
        Shelf(tmp_path / "tuf", tmp_path / "keys", passphrase=Passphrase("some other long words")).refresh()
    with pytest.raises(Refused, match="cannot read the passphrase"):
        Shelf(tmp_path / "tuf", tmp_path / "keys").refresh()
    with pytest.raises(Refused, match="16 characters or more"):
        Shelf(tmp_path / "tuf", tmp_path / "keys", passphrase=Passphrase("short")).refresh()
    (tmp_path / "word").chmod(0o644)
    with pytest.raises(Refused, match="0600"):
        Shelf(tmp_path / "tuf", tmp_path / "keys", passphrase=by_file).refresh()


def test_the_passphrase_is_told_by_the_environment(tmp_path: Path) -> None:
    assert passphrase_from({}) == Passphrase()
    assert passphrase_from({"RAPP_CLOUD_PASSPHRASE": SECRET}) == Passphrase(SECRET)
    both = {"RAPP_CLOUD_PASSPHRASE": SECRET, "RAPP_CLOUD_PASSPHRASE_FILE": "word"}
    assert passphrase_from(both) == Passphrase(None, Path("word"))
    assert SECRET not in repr(Passphrase(SECRET))


def test_a_file_that_is_no_key(tmp_path: Path) -> None:
    ring = KeyRing(tmp_path / "keys", Passphrase(SECRET))
    ring.keep("root", ring.new("root"))
    (tmp_path / "keys" / "root.pem").write_bytes(b"-----BEGIN PRIVATE KEY-----")
    with pytest.raises(Invalid, match="it is not a key"):
        ring.signer("root")


@pytest.mark.parametrize("role", [*ROLES, "rapp"])
def test_rotation_is_followed_by_robots_old_and_new(shelf: Shelf, robot: TrustedStore, tmp_path: Path, role: str) -> None:
    assert offered(robot) == ["1.0.0"]
    old, before = shelf._keys.signer(role), {name: key_of(shelf, name) for name in (*ROLES, "rapp")}
    shelf.custody.rotate(role)
    after = {name: key_of(shelf, name) for name in (*ROLES, "rapp")}
    assert {name for name in after if after[name] != before[name]} == {role}
    shelf.publish(package(tmp_path, version="1.1.0"))
    assert offered(robot) == ["1.0.0", "1.1.0"]
    newcomer = TrustedStore(StoreFolder(tmp_path / "tuf"), "store:", shelf.root_file.read_bytes(), tmp_path / "new")
    assert offered(newcomer) == ["1.0.0", "1.1.0"]
    assert not (tmp_path / "keys" / f"next_{role}.pem").exists()
    shelf._keys.keep(role, old)  # a thief has the old key
    with pytest.raises(Refused, match="not the one that robots believe"):
        shelf._ledger.signer(shelf._ledger.read(), role)


@pytest.mark.parametrize("role", [*ROLES, "rapp"])
def test_a_rotation_cut_short_loses_no_key(shelf: Shelf, robot: TrustedStore, tmp_path: Path, role: str) -> None:
    """Power goes after each write of a rotation; the store goes on."""
    before = Kept(tmp_path)
    for writes in range(8):
        before.again()
        cut_after(writes, lambda: shelf.custody.rotate(role))
        shelf.refresh()
        shelf.publish(package(tmp_path, version="1.1.0"))
        assert offered(robot) == ["1.0.0", "1.1.0"], f"after {writes} writes"
        shelf.custody.rotate(role)
        assert offered(robot) == ["1.0.0", "1.1.0"]


class Kept:
    """All files below a folder as they are now."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    def again(self) -> None:
        for folder in ("tuf", "keys", "trust"):
            shutil.rmtree(self._folder / folder, ignore_errors=True)
        for path, data in self._files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            path.chmod(0o600)


class PowerGone(BaseException):
    """Nothing happens after this."""


def cut_after(writes: int, change: Callable[[], None]) -> None:
    left = [writes]

    def limited(original):  # type: ignore[no-untyped-def]
        def write(*args, **kwargs):  # type: ignore[no-untyped-def]
            if not left[0]:
                raise PowerGone
            left[0] -= 1
            original(*args, **kwargs)

        return write

    with pytest.MonkeyPatch.context() as patch:
        for module in ("ledger", "keys"):
            patch.setattr(f"rapp_cloud.{module}.write_whole", limited(write_whole))
        try:
            change()
        except PowerGone:
            return


def test_a_root_of_three_keys_outlives_one_of_them(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    assert offered(robot) == ["1.0.0"]
    shelf.custody.share_root(3, 2)
    (root, *_) = shelf.custody.holders()
    assert (len(root.keys), root.threshold, root.here) == (3, 2, True)
    (tmp_path / "keys" / "root_2.pem").unlink()  # lost
    for role in ("targets", "root"):
        shelf.custody.rotate(role)
        shelf.publish(package(tmp_path, version=f"1.0.{len(role)}"))
    assert offered(robot) == ["1.0.0", "1.0.4", "1.0.7"]
    assert len(set(shelf.custody.holders()[0].keys) - set(root.keys)) == 3
    shelf.custody.share_root(1, 1)
    assert not list((tmp_path / "keys").glob("root_*.pem"))
    newcomer = TrustedStore(StoreFolder(tmp_path / "tuf"), "store:", shelf.root_file.read_bytes(), tmp_path / "new")
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


def test_a_publisher_of_their_own(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    shelf.custody.add("maria")
    with pytest.raises(Refused, match="the name is taken"):
        shelf.custody.add("maria")
    with pytest.raises(Refused, match="the name is taken"):
        shelf.custody.add("targets")
    with pytest.raises(Refused, match="no such publisher"):
        shelf.publish(package(tmp_path, "clock"), publisher="nobody")
    shelf.publish(package(tmp_path, "clock"), publisher="maria")
    with pytest.raises(Refused, match="the name is rapp's"):
        shelf.publish(package(tmp_path, "hello", "2.0.0"), publisher="maria")
    shelf.publish(package(tmp_path, "clock", "1.1.0"))  # the owner signs
    assert offered(robot, "clock") == ["1.0.0", "1.1.0"]
    assert {offer.manifest.name: offer.publisher for offer in shelf.offers()} == {"clock": "maria", "hello": "rapp"}
    holders = {holder.name: holder for holder in shelf.custody.holders()}
    assert (holders["maria"].packages, holders["rapp"].packages) == (("clock",), ("hello",))


def test_s03_what_a_revoked_publisher_signed_is_gone_and_the_name_stays_theirs(
    shelf: Shelf, robot: TrustedStore, tmp_path: Path
) -> None:
    shelf.custody.add("maria")
    shelf.publish(package(tmp_path, "clock"), publisher="maria")
    assert offered(robot, "clock") == ["1.0.0"]
    shelf.custody.revoke("maria")
    with pytest.raises(Refused, match="cannot find clock"):
        choose(robot.versions("clock"), "clock")
    assert offered(robot) == ["1.0.0"]
    assert not (tmp_path / "keys" / "maria.pem").exists()
    with pytest.raises(Refused, match="it is maria's, whose key was revoked"):
        shelf.publish(package(tmp_path, "clock", "2.0.0"))
    shelf.custody.add("maria")
    with pytest.raises(Refused, match="other bytes"):
        shelf.publish(package(tmp_path, "clock", program="evil()\n"), publisher="maria")
    shelf.publish(package(tmp_path, "clock", "1.0.1"), publisher="maria")
    assert offered(robot, "clock") == ["1.0.1"]


def test_roles_are_rotated_not_revoked_and_strangers_are_unknown(shelf: Shelf) -> None:
    with pytest.raises(Refused, match="rotate it"):
        shelf.custody.revoke("snapshot")
    with pytest.raises(Refused, match="it has none"):
        shelf.custody.revoke("nobody")
    with pytest.raises(Refused, match="it has none"):
        shelf.custody.rotate("nobody")


def test_the_platform_serves_without_the_keys_that_publish(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    for name in ("root", "targets", "rapp"):
        (tmp_path / "keys" / f"{name}.pem").rename(tmp_path / f"{name}.pem")
    shelf.refresh()
    assert offered(robot) == ["1.0.0"]
    with pytest.raises(Refused, match=r"rapp\.pem is not in"):
        shelf.publish(package(tmp_path, version="1.1.0"))
    assert offered(robot) == ["1.0.0"]


def test_a_root_whose_time_is_half_over_is_signed_anew(tmp_path: Path) -> None:
    short = Expiry(root=timedelta(days=100))
    Shelf(tmp_path / "tuf", tmp_path / "keys", short).create()
    Shelf(tmp_path / "tuf", tmp_path / "keys").refresh()
    expires = Metadata.from_file(str(tmp_path / "tuf/metadata/2.root.json")).signed.expires
    assert expires > datetime.now(UTC) + timedelta(days=300)


def test_yanked_versions_stay_known(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    shelf.publish(package(tmp_path, version="1.1.0"))
    shelf.yank("hello", "1.1.0")
    offers = robot.versions("hello")
    assert [release.version.text for release in offers.releases] == ["1.0.0"]
    assert offers.yanked == {"1.1.0"}
    assert [(offer.manifest.version.text, offer.yanked) for offer in shelf.offers(yanked=True)] == [
        ("1.0.0", False), ("1.1.0", True),
    ]  # fmt: skip
    with pytest.raises(Refused, match="not on offer"):
        shelf.yank("hello", "1.1.0")
    with pytest.raises(Refused, match="other bytes"):
        shelf.publish(package(tmp_path, version="1.1.0", program="evil()\n"))
    shelf.publish(package(tmp_path, version="1.1.0"))
    assert offered(robot) == ["1.0.0", "1.1.0"]


def test_a_store_of_an_earlier_version_is_adopted(tmp_path: Path) -> None:
    """Keys in the clear, all packages in targets itself; robots know its root already."""
    data = package(tmp_path)
    earlier_store(tmp_path, data)
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    robot = TrustedStore(StoreFolder(tmp_path / "tuf"), "store:", shelf.root_file.read_bytes(), tmp_path / "trust")
    assert offered(robot) == ["1.0.0"]
    assert [manifest.name for manifest in shelf.manifests()] == ["hello"]
    for _ in range(2):
        shelf.adopt()
        assert offered(robot) == ["1.0.0"]
        assert not any(b"BEGIN PRIVATE" in path.read_bytes() for path in (tmp_path / "keys").iterdir())
    assert [offer.publisher for offer in shelf.offers()] == ["rapp"]
    shelf.publish(package(tmp_path, version="1.1.0"))
    assert offered(robot) == ["1.0.0", "1.1.0"]


def earlier_store(folder: Path, data: bytes) -> None:
    metadata, targets, keys = folder / "tuf" / "metadata", folder / "tuf" / "targets", folder / "keys"
    for place in (metadata, targets, keys):
        place.mkdir(parents=True)
    later = datetime.now(UTC).replace(microsecond=0) + timedelta(days=300)
    signers = {role: CryptoSigner.generate_ed25519() for role in ROLES}
    root, listed = Root(expires=later), Targets(expires=later)
    for role, signer in signers.items():
        root.add_key(signer.public_key, role)
        (keys / f"{role}.pem").write_bytes(signer.private_bytes)
        (keys / f"{role}.pem").chmod(0o600)
    shelf_target = TargetFile.from_data("hello-1.0.0.hz", data, ["sha256"])
    shelf_target.unrecognized_fields["custom"] = {"name": "hello", "version": "1.0.0"}
    listed.targets["hello-1.0.0.hz"] = shelf_target
    (targets / f"{shelf_target.hashes['sha256']}.hello-1.0.0.hz").write_bytes(data)
    snapshot, timestamp = Snapshot(expires=later), Timestamp(expires=later)

    def write(name: str, signed: Root | Targets | Snapshot | Timestamp, role: str) -> bytes:
        whole: Metadata[Root | Targets | Snapshot | Timestamp] = Metadata(signed)
        whole.sign(signers[role])
        (metadata / name).write_bytes(whole.to_bytes())
        return whole.to_bytes()

    write("1.root.json", root, "root")
    snapshot.meta["targets.json"] = MetaFile.from_data(1, write("1.targets.json", listed, "targets"), ["sha256"])
    timestamp.snapshot_meta = MetaFile.from_data(1, write("1.snapshot.json", snapshot, "snapshot"), ["sha256"])
    write("timestamp.json", timestamp, "timestamp")


def test_s13_a_package_for_some_robots(shelf: Shelf, robot: TrustedStore, tmp_path: Path) -> None:
    shelf.publish(package(tmp_path, "clock"), robots=("nao1",))
    found = robot.versions("clock")
    assert choose(found, "clock", robot="nao1").robots == ("nao1",)
    with pytest.raises(Untrusted) as caught:
        choose(found, "clock", robot="nao2")
    assert caught.value.attack == Attack.OTHER_ROBOT
