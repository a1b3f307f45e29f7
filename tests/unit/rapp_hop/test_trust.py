"""Each attack on the store is refused and named; what was seen before is what counts (S01 … S12)."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from securesystemslib.signer import CryptoSigner

from fakes.repository import URL, Repository
from rapp_hop.errors import Invalid, Refused, Unreachable
from rapp_hop.hz.tar import Limits
from rapp_hop.hz.trust import Attack, TrustedStore, Untrusted, newest


@pytest.fixture
def repository() -> Repository:
    repository = Repository()
    repository.publish("hello", "1.0.0", b"package one")
    return repository


@pytest.fixture
def store(repository: Repository, tmp_path: Path) -> TrustedStore:
    return TrustedStore(repository, URL, repository.trusted_root, tmp_path / "trust")


def attack_of(store: TrustedStore) -> Attack:
    with pytest.raises(Untrusted) as caught:
        store.releases()
    assert str(caught.value).startswith("cannot trust the store")
    return caught.value.attack


def test_lists_and_downloads_what_is_signed(store: TrustedStore, tmp_path: Path) -> None:
    told: list[int] = []
    release = newest(store.releases(), "hello")
    store.download(release, tmp_path / "got.hz", lambda count, _: told.append(count))
    assert (tmp_path / "got.hz").read_bytes() == b"package one"
    assert (release.version.text, release.length, told) == ("1.0.0", 11, [11])


def test_newest_prefers_releases_and_numbers_over_text(store: TrustedStore, repository: Repository) -> None:
    for version in ("1.9.0", "1.10.0", "2.0.0-rc.1"):
        repository.publish("hello", version, version.encode())
    assert newest(store.releases(), "hello").version.text == "1.10.0"
    assert newest(store.releases(), "hello", "2.0.0-rc.1").version.text == "2.0.0-rc.1"
    with pytest.raises(Refused, match="cannot find nothing"):
        newest(store.releases(), "nothing")


def test_s01_unsigned(store: TrustedStore, repository: Repository) -> None:
    data = repository.files["metadata/timestamp.json"]
    start = data.index(b'"sig":"') + 7 if b'"sig":"' in data else data.index(b'"sig": "') + 8
    repository.files["metadata/timestamp.json"] = data[:start] + b"00" * 64 + data[start + 128 :]
    assert attack_of(store) == Attack.UNSIGNED


@pytest.mark.parametrize("role", ["targets", "snapshot", "timestamp"])
def test_s02_wrong_key(store: TrustedStore, repository: Repository, role: str) -> None:
    repository.sign(**{role: CryptoSigner.generate_ed25519()})
    assert attack_of(store) == Attack.UNSIGNED


def test_s02_wrong_key_keeps_out_what_it_signed_for(store: TrustedStore, repository: Repository) -> None:
    assert [release.version.text for release in store.releases()] == ["1.0.0"]
    good = dict(repository.files)
    repository.publish("hello", "6.6.6", b"evil")
    stranger = CryptoSigner.generate_ed25519()
    repository.sign(targets=stranger, snapshot=stranger, timestamp=stranger)
    assert attack_of(store) == Attack.UNSIGNED
    repository.files = good
    assert [release.version.text for release in store.releases()] == ["1.0.0"]


@pytest.mark.parametrize("role", ["targets", "snapshot", "timestamp"])
def test_s04_freeze(store: TrustedStore, repository: Repository, role: str) -> None:
    getattr(repository, role).expires = datetime.now(UTC).replace(microsecond=0) - timedelta(seconds=1)
    repository.sign()
    assert attack_of(store) == Attack.FREEZE


def test_s05_rollback(store: TrustedStore, repository: Repository) -> None:
    old = dict(repository.files)
    repository.publish("hello", "1.0.1", b"safer")
    store.releases()
    repository.files = old
    assert attack_of(store) == Attack.ROLLBACK


def test_s05_rollback_of_the_snapshot_under_a_newer_timestamp(store: TrustedStore, repository: Repository) -> None:
    repository.publish("hello", "1.0.1", b"safer")
    store.releases()
    repository.timestamp.version += 1
    repository.snapshot.version -= 1
    repository.sign()
    assert attack_of(store) == Attack.ROLLBACK


def test_s05_rollback_is_remembered_by_the_next_process(repository: Repository, tmp_path: Path) -> None:
    old = dict(repository.files)
    repository.publish("hello", "1.0.1", b"safer")
    TrustedStore(repository, URL, repository.trusted_root, tmp_path / "trust").releases()
    repository.files = old
    assert attack_of(TrustedStore(repository, URL, repository.trusted_root, tmp_path / "trust")) == Attack.ROLLBACK


@pytest.mark.parametrize("role", ["targets", "snapshot"])
def test_s06_mix_and_match(store: TrustedStore, repository: Repository, role: str) -> None:
    old = dict(repository.files)
    repository.publish("hello", "1.0.1", b"safer")
    repository.files[f"metadata/3.{role}.json"] = old[f"metadata/2.{role}.json"]
    assert attack_of(store) == Attack.MIX_AND_MATCH


def test_s08_wrong_hash(store: TrustedStore, repository: Repository, tmp_path: Path) -> None:
    release = newest(store.releases(), "hello")
    repository.files[repository.package_path("hello", "1.0.0")] = b"package two"
    with pytest.raises(Untrusted) as caught:
        store.download(release, tmp_path / "got.hz")
    assert caught.value.attack == Attack.WRONG_CONTENT
    assert not (tmp_path / "got.hz").exists()


def test_s08_s11_wrong_length(store: TrustedStore, repository: Repository, tmp_path: Path) -> None:
    release = newest(store.releases(), "hello")
    repository.files[repository.package_path("hello", "1.0.0")] = b"package"
    with pytest.raises(Untrusted) as caught:
        store.download(release, tmp_path / "got.hz")
    assert caught.value.attack == Attack.WRONG_CONTENT


def test_s09_endless_package(store: TrustedStore, repository: Repository, tmp_path: Path) -> None:
    release = newest(store.releases(), "hello")
    repository.files[repository.package_path("hello", "1.0.0")] = b"package one, and on and on"
    with pytest.raises(Untrusted) as caught:
        store.download(release, tmp_path / "got.hz")
    assert caught.value.attack == Attack.ENDLESS_DATA


def test_s09_endless_metadata_and_every_request_has_a_limit(store: TrustedStore, repository: Repository) -> None:
    repository.files["metadata/timestamp.json"] = b" " * 10_000_000
    assert attack_of(store) == Attack.ENDLESS_DATA
    assert max(limit for _, limit in repository.asked) <= 5_000_000


def test_s12_a_right_package_of_another_rapp(store: TrustedStore, repository: Repository, tmp_path: Path) -> None:
    repository.publish("parrot", "1.0.0", b"package 1st")
    release = newest(store.releases(), "hello")
    repository.files[repository.package_path("hello", "1.0.0")] = b"package 1st"
    with pytest.raises(Untrusted):
        store.download(release, tmp_path / "got.hz")


def test_s14_root_may_change_its_keys_but_not_by_a_stranger(store: TrustedStore, repository: Repository) -> None:
    stranger = Repository()
    stranger.root.version = 2
    stranger._write("2.root.json", stranger.root, "root")
    repository.files["metadata/2.root.json"] = stranger.files["metadata/2.root.json"]
    assert attack_of(store) == Attack.UNSIGNED


def test_malformed_metadata(store: TrustedStore, repository: Repository) -> None:
    repository.files["metadata/timestamp.json"] = b"<html>captive portal</html>"
    assert attack_of(store) == Attack.MALFORMED


def test_s16_away_or_incomplete_is_unreachable(store: TrustedStore, repository: Repository) -> None:
    del repository.files["metadata/2.snapshot.json"]
    with pytest.raises(Unreachable):
        store.releases()
    repository.away = True
    with pytest.raises(Unreachable, match="try again later"):
        store.releases()


def test_a_package_larger_than_we_take_is_not_asked_for(repository: Repository, tmp_path: Path) -> None:
    store = TrustedStore(repository, URL, repository.trusted_root, tmp_path / "trust", Limits(packed=5))
    with pytest.raises(Invalid, match="11 bytes, 5 are allowed"):
        store.download(newest(store.releases(), "hello"), tmp_path / "got.hz")
    assert not any(path.startswith("targets/") for path, _ in repository.asked)


def test_targets_that_are_no_packages_are_left_out(store: TrustedStore, repository: Repository) -> None:
    for path, custom in [("evil-1.0.0.hz", {"name": "hello", "version": "9.9.9"}), ("notes.txt", None)]:
        repository.publish("evil", "1.0.0", b"x")
        target = repository.targets.targets.pop("evil-1.0.0.hz")
        target.path = path
        target.unrecognized_fields = {"custom": custom} if custom else {}
        repository.targets.targets[path] = target
    repository.next()
    assert [(release.name, release.version.text) for release in store.releases()] == [("hello", "1.0.0")]
