"""What is signed is listed and brought; what is not complete or too large is not (the attacks: test_store_attacks.py)."""

from pathlib import Path

import pytest

from fakes.repository import URL, Repository
from rapp_hop.errors import Invalid, Refused, Unreachable
from rapp_hop.hz.tar import Limits
from rapp_hop.hz.trust import Attack, TrustedStore, Untrusted, choose


@pytest.fixture
def repository() -> Repository:
    repository = Repository()
    repository.publish("hello", "1.0.0", b"package one")
    return repository


@pytest.fixture
def store(repository: Repository, tmp_path: Path) -> TrustedStore:
    return TrustedStore(repository, URL, repository.trusted_root, tmp_path / "trust")


def test_lists_and_downloads_what_is_signed(store: TrustedStore, tmp_path: Path) -> None:
    told: list[int] = []
    release = choose(store.versions("hello"), "hello")
    store.download(release, tmp_path / "got.hz", lambda count, _: told.append(count))
    assert (tmp_path / "got.hz").read_bytes() == b"package one"
    assert (release.version.text, release.length, told) == ("1.0.0", 11, [11])


def test_the_newest_is_a_release_and_numbers_are_numbers(store: TrustedStore, repository: Repository) -> None:
    for version in ("1.9.0", "1.10.0", "2.0.0-rc.1"):
        repository.publish("hello", version, version.encode())
    offered = store.versions("hello")
    assert choose(offered, "hello").version.text == "1.10.0"
    assert choose(offered, "hello", "2.0.0-rc.1").version.text == "2.0.0-rc.1"
    for name in ("nothing", "hell", "parrot"):
        with pytest.raises(Refused, match=f"cannot find {name} in the store"):
            choose(store.versions(name), name)


def test_only_the_list_of_the_name_s_publisher_is_asked_for(store: TrustedStore, repository: Repository) -> None:
    repository.add_publisher("other", "clock")
    repository.publish("clock", "1.0.0", b"tick", "other")
    assert [release.name for release in store.versions("clock").releases] == ["clock"]
    assert [path for path, _ in repository.asked if "rapp" in path] == []


def test_every_request_has_a_limit(store: TrustedStore, repository: Repository) -> None:
    store.versions("hello")
    assert max(limit for _, limit in repository.asked) <= 5_000_000


def test_malformed_lists(store: TrustedStore, repository: Repository) -> None:
    for data in (b"<html>captive portal</html>", b"[]", b"{}", b"\xff"):
        repository.files["metadata/timestamp.json"] = data
        with pytest.raises(Untrusted) as caught:
            store.versions("hello")
        assert caught.value.attack == Attack.MALFORMED


def test_away_or_incomplete_is_unreachable(store: TrustedStore, repository: Repository) -> None:
    del repository.files["metadata/2.snapshot.json"]
    with pytest.raises(Unreachable):
        store.versions("hello")
    repository.away = True
    with pytest.raises(Unreachable, match="try again later"):
        store.versions("hello")


def test_a_package_larger_than_we_take_is_not_asked_for(repository: Repository, tmp_path: Path) -> None:
    store = TrustedStore(repository, URL, repository.trusted_root, tmp_path / "trust", Limits(packed=5))
    with pytest.raises(Invalid, match="11 bytes, 5 are allowed"):
        store.download(choose(store.versions("hello"), "hello"), tmp_path / "got.hz")
    assert not any(path.startswith("targets/") for path, _ in repository.asked)


def test_targets_that_are_no_packages_are_left_out(store: TrustedStore, repository: Repository) -> None:
    targets = repository.publishers["rapp"].targets
    for path, custom in [("hello-2.0.0.hz", {"name": "hello", "version": "9.9.9"}), ("hello-notes.hz", None)]:
        repository.publish("hello", "1.0.1", b"x")
        target = targets.pop("hello-1.0.1.hz")
        target.path = path
        target.unrecognized_fields = {"custom": custom} if custom else {}
        targets[path] = target
    repository.next()
    assert [release.version.text for release in store.versions("hello").releases] == ["1.0.0"]
