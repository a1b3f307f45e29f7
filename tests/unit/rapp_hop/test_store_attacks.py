"""S01 to S13 of the list of attacks on store and metadata: refused by name, and the old version is still there.

S14, S15 and S19: test_store_roots.py. S16 to S18 need a real line and a real disk: tests/integration/rapp_hop/test_store_line.py.
S20: test_shelf.py.
"""

import asyncio
from collections.abc import Callable
from datetime import timedelta

import pytest
from securesystemslib.signer import CryptoSigner

from fakes.repository import PUBLISHER, Repository
from fakes.store_robot import ALL, Robot
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.hz.trust import Attack, Untrusted
from rapp_hop.streaming import Writer


def test_s00_without_an_attack_the_new_version_comes(robot: Robot) -> None:
    assert robot.gets() == "1.1.0"
    assert robot.phases[-2:] == ["verified", "installed"]


@pytest.mark.parametrize("role", ALL)
def test_s01_unsigned(robot: Robot, repository: Repository, role: str) -> None:
    """Hashes and lengths fit: whoever forges one list can forge what is above it, but for the signatures."""
    repository.sign(unsigned=role)
    robot.refuses(Attack.UNSIGNED)


@pytest.mark.parametrize("role", ALL)
def test_s02_wrong_key(robot: Robot, repository: Repository, role: str) -> None:
    repository.sign(**{role: CryptoSigner.generate_ed25519()})
    robot.refuses(Attack.UNSIGNED)


def test_s02_all_lists_by_a_stranger(robot: Robot, repository: Repository) -> None:
    stranger = CryptoSigner.generate_ed25519()
    repository.sign(**dict.fromkeys(ALL, stranger))
    robot.refuses(Attack.UNSIGNED)


@pytest.mark.parametrize("role", ["targets", "snapshot", "timestamp"])
def test_s03_key_of_a_role_revoked(robot: Robot, repository: Repository, role: str) -> None:
    revoked = repository.new_key(role)
    repository.root.version += 1
    repository.write_root()
    repository.next()
    repository.sign(**{role: revoked})  # the thief goes on signing
    robot.refuses(Attack.UNSIGNED)
    repository.next()
    assert robot.gets() == "1.1.0"


def test_s03_key_of_a_publisher_revoked(robot: Robot, repository: Repository) -> None:
    thief = repository.signers[PUBLISHER]
    repository.targets.revoke_key(thief.public_key.keyid, PUBLISHER)
    repository.signers[PUBLISHER] = CryptoSigner.generate_ed25519()
    repository.targets.add_key(repository.signers[PUBLISHER].public_key, PUBLISHER)
    repository.next()
    repository.sign(**{PUBLISHER: thief})
    robot.refuses(Attack.UNSIGNED)
    assert repository.targets.delegations is not None and repository.targets.delegations.roles is not None
    del repository.targets.delegations.roles[PUBLISHER]
    repository.next()
    with pytest.raises(Refused, match="cannot find hello in the store"):
        robot.gets()
    robot.is_as_before()


@pytest.mark.parametrize("role", ALL)
def test_s04_expired_is_freeze(robot: Robot, repository: Repository, role: str) -> None:
    repository.lists[role].expires = repository.now - timedelta(seconds=1)
    repository.next()
    robot.refuses(Attack.FREEZE)


def test_s05_older_than_seen_is_rollback(robot: Robot, repository: Repository, package: Callable[..., bytes]) -> None:
    repository.publish("parrot", "1.0.0", package("1.0.0", "parrot"))
    seen = dict(repository.files)
    with pytest.raises(Refused):
        robot.gets("nothing")  # the robot sees the newest lists, without installing
    repository.files = robot.old
    robot.refuses(Attack.ROLLBACK)
    repository.files = seen
    assert robot.gets() == "1.1.0"


def test_s05_an_older_package_than_the_installed_one(robot: Robot, repository: Repository) -> None:
    del repository.publishers[PUBLISHER].targets["hello-1.0.0.hz"]
    assert robot.gets() == "1.1.0"
    target = repository.publishers[PUBLISHER].targets.pop("hello-1.1.0.hz")
    repository.publish("hello", "1.0.5", b"an old fault")
    with pytest.raises(Untrusted) as caught:
        robot.gets()
    assert caught.value.attack == Attack.ROLLBACK
    repository.publishers[PUBLISHER].unrecognized_fields["yanked"] = {"hello-1.1.0.hz": target.hashes["sha256"]}
    repository.next()
    with pytest.raises(Exception, match="it is not a gzip"):  # its publisher said so: it is fetched
        robot.gets()


@pytest.mark.parametrize("role", ALL[:3])
def test_s06_mix_and_match(robot: Robot, repository: Repository, role: str) -> None:
    repository.files[f"metadata/3.{role}.json"] = robot.old[f"metadata/2.{role}.json"]
    robot.refuses(Attack.MIX_AND_MATCH)


def test_s07_fast_forward_and_recovery(robot: Robot, repository: Repository) -> None:
    right = (repository.snapshot.version, repository.timestamp.version)
    repository.snapshot.version = repository.timestamp.version = 2**63 - 1  # by a thief of both keys
    repository.sign()
    with pytest.raises(Refused):
        robot.gets("nothing")
    repository.snapshot.version, repository.timestamp.version = right
    repository.sign()
    robot.refuses(Attack.ROLLBACK)
    repository.new_key("snapshot")
    repository.new_key("timestamp")
    repository.root.version += 1
    repository.write_root()
    repository.sign()
    assert robot.gets() == "1.1.0"


def test_s08_right_length_wrong_hash(robot: Robot, repository: Repository) -> None:
    path = repository.package_path("hello", "1.1.0")
    data = bytearray(repository.files[path])
    data[len(data) // 2] ^= 1
    repository.files[path] = bytes(data)
    robot.refuses(Attack.WRONG_CONTENT)


def test_s08_right_hash_wrong_length(robot: Robot, repository: Repository) -> None:
    target = repository.publishers[PUBLISHER].targets["hello-1.1.0.hz"]
    target.length += 1
    repository.next()
    robot.refuses(Attack.WRONG_CONTENT)


def test_s09_endless_package(robot: Robot, repository: Repository) -> None:
    path = repository.package_path("hello", "1.1.0")
    repository.files[path] += b", and on and on"
    robot.refuses(Attack.ENDLESS_DATA)


@pytest.mark.parametrize("role", ALL)
def test_s09_endless_metadata(robot: Robot, repository: Repository, role: str) -> None:
    name = "timestamp" if role == "timestamp" else f"3.{role}"
    repository.files[f"metadata/{name}.json"] = b" " * 10_000_000
    robot.refuses(Attack.ENDLESS_DATA)


@pytest.mark.parametrize("where", ["/metadata/", "/targets/"])
def test_s10_slow_retrieval(robot: Robot, where: str) -> None:
    async def trickle(path: str, write: Writer) -> None:
        while where in path:
            write(b" ")
            await asyncio.sleep(0.02)

    robot.client.before = trickle
    with pytest.raises(Unreachable, match="slow retrieval") as caught:
        robot.gets()
    assert caught.value.reason == Attack.SLOW.value
    robot.is_as_before()


@pytest.mark.parametrize("tenth", range(10))
def test_s11_body_shorter_than_announced(robot: Robot, repository: Repository, tenth: int) -> None:
    path = repository.package_path("hello", "1.1.0")
    whole = repository.files[path]
    repository.files[path] = whole[: len(whole) * tenth // 10]
    robot.refuses(Attack.WRONG_CONTENT)
    repository.files[path] = whole
    assert robot.gets() == "1.1.0"


def test_s12_right_package_of_another_rapp(robot: Robot, repository: Repository, package: Callable[..., bytes]) -> None:
    repository.publish("parrot", "1.0.0", package("1.0.0", "parrot"))
    repository.files[repository.package_path("hello", "1.1.0")] = repository.files[repository.package_path("parrot", "1.0.0")]
    with pytest.raises(Untrusted) as caught:
        robot.gets()
    assert caught.value.attack in (Attack.WRONG_CONTENT, Attack.ENDLESS_DATA)
    robot.is_as_before()


def test_s12_a_publisher_signs_for_another_s_name(robot: Robot, repository: Repository, package: Callable[..., bytes]) -> None:
    repository.add_publisher("evil", "game")
    repository.publish("hello", "9.0.0", package("9.0.0"), "evil")
    assert robot.gets() == "1.1.0"


def test_s13_replay_to_another_robot(robot: Robot, repository: Repository, package: Callable[..., bytes]) -> None:
    repository.publish("parrot", "1.0.0", package("1.0.0", "parrot"), robots=["nao2", "nao3"])
    robot.refuses(Attack.OTHER_ROBOT, "parrot")
    repository.publish("hello", "2.0.0", package("2.0.0"), robots=["nao2"])
    assert robot.gets() == "1.1.0"
    repository.publish("hello", "2.0.1", package("2.0.1"), robots=["nao2", "nao1"])
    assert robot.gets() == "2.0.1"


def test_s13_a_package_for_another_kind_of_robot(robot: Robot, repository: Repository, package: Callable[..., bytes]) -> None:
    repository.publish("hello", "2.0.0", package("2.0.0", needs={"robot": ["pepper"], "api": ">=2.0"}))
    with pytest.raises(Refused, match=r"it needs a robot of kind pepper, this is nao; it needs API >=2\.0"):
        robot.gets()
    robot.phases.clear()  # verified it was
    robot.is_as_before()


def test_a_cloud_agent_is_never_installed_on_a_robot(robot: Robot, repository: Repository, package: Callable[..., bytes]) -> None:
    cloud = package("1.0.0", "parrot", agent="cloud", keywords={}, sentences={}, permissions={"core": [], "cloud": []})
    repository.publish("parrot", "1.0.0", cloud)
    with pytest.raises(Refused, match="which the platform runs"):
        robot.gets("parrot")
    robot.phases.clear()
    robot.is_as_before()
