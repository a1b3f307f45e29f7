"""Keys: made, encrypted, rotated, revoked; publishers keep their names; robots follow or refuse."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import Metadata, MetaFile, Root, Snapshot, TargetFile, Targets, Timestamp

from fakes.power import Kept, cut_after
from fakes.small_store import offered, package, robot_of, shelf_with_hello
from rapp_cloud.keys import ROLES, KeyRing, Passphrase, passphrase_from
from rapp_cloud.ledger import Expiry
from rapp_cloud.shelf import Shelf
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.trust import Attack, TrustedStore, Untrusted, choose

SECRET = "correct horse battery staple"


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    return shelf_with_hello(tmp_path)


@pytest.fixture
def robot(shelf: Shelf, tmp_path: Path) -> TrustedStore:
    return robot_of(shelf, tmp_path, "trust")


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
    newcomer = robot_of(shelf, tmp_path, "new")
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
    robot = robot_of(shelf, tmp_path, "trust")
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
