"""S01 to S15 and S19 of the list of attacks on store and metadata: refused by name, and the old version is still there.

S16 to S18 need a real line and a real disk: tests/integration/rapp_hop/test_store_line.py. S20: test_shelf.py.
"""

import asyncio
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from securesystemslib.signer import CryptoSigner

from fakes.packages import source_folder
from fakes.repository import LASTS, PUBLISHER, Client, Repository
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.hz.archive import build
from rapp_hop.hz.delivery import Delivery, DeliveryLimits, Recipient
from rapp_hop.hz.install import Installed
from rapp_hop.hz.trust import Attack, Untrusted
from rapp_hop.streaming import Writer

YEARS = timedelta(days=3653)
NAO = Recipient("nao1", "nao", "1.0")
ALL = [PUBLISHER, "targets", "snapshot", "timestamp"]


class Robot:
    """Has hello 1.0.0, while its store offers 1.1.0."""

    def __init__(self, repository: Repository, home: Path) -> None:
        self.client = Client(repository)
        self.home = home
        self.old: dict[str, bytes] = {}  # what an attacker may have kept of the line
        limits = DeliveryLimits(window=0.2)
        self.delivery = Delivery(self.client, repository.trusted_root, home, limits)  # type: ignore[arg-type]

    async def installs(self, name: str = "hello", version: str | None = None) -> Installed:
        self.phases: list[str] = []
        return await self.delivery.install(name, version, lambda phase, _: self.phases.append(phase), NAO)

    def gets(self, name: str = "hello", version: str | None = None) -> str:
        return asyncio.run(self.installs(name, version)).version

    def refuses(self, attack: Attack, name: str = "hello") -> None:
        with pytest.raises(Untrusted) as caught:
            self.gets(name)
        assert (caught.value.attack, caught.value.reason) == (attack, attack.value), str(caught.value)
        self.is_as_before()

    def is_as_before(self) -> None:
        """Nothing was unpacked, of the download is left at most what the next one goes on from, the old version runs."""
        assert not {"verified", "installed"} & set(self.phases)
        installed = self.delivery.folder.find("hello")
        assert installed is not None and installed.version == "1.0.0"
        assert (installed.path / "agent.py").read_text() == "print('1.0.0')\n"
        assert sorted(path.name for path in (self.home / "rapps" / "hello").iterdir()) == ["1.0.0", "current"]
        assert [path.name for path in (self.home / "rapps").iterdir() if path.name != ".lock"] == ["hello"]
        downloads = self.home / "downloads"
        assert not downloads.exists() or {path.suffix for path in downloads.iterdir()} <= {".part"}


@pytest.fixture
def package(tmp_path: Path) -> Callable[..., bytes]:
    def make(version: str, name: str = "hello", **rapp: Any) -> bytes:
        return build(source_folder(tmp_path / "sources" / name / version, name, version, f"print({version!r})\n", **rapp))

    return make


@pytest.fixture
def repository(package: Callable[..., bytes]) -> Repository:
    repository = Repository()
    repository.publish("hello", "1.0.0", package("1.0.0"))
    return repository


@pytest.fixture
def robot(repository: Repository, package: Callable[..., bytes], tmp_path: Path) -> Robot:
    robot = Robot(repository, tmp_path / "robot")
    assert robot.gets() == "1.0.0"
    robot.old = dict(repository.files)
    repository.publish("hello", "1.1.0", package("1.1.0"))
    return robot


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


def rotate_root(repository: Repository) -> CryptoSigner:
    old = repository.new_key("root")
    repository.root.version += 1
    repository.write_root(old, repository.signers["root"])
    return old


def test_s14_root_rotated_three_times_in_a_row(robot: Robot, repository: Repository) -> None:
    for _ in range(3):
        rotate_root(repository)
    assert robot.gets() == "1.1.0"


def test_s14_root_number_skipped_is_not_followed(robot: Robot, repository: Repository) -> None:
    repository.root.version += 1
    thief = repository.new_key("timestamp")
    repository.root.version += 1
    repository.write_root()
    assert thief is not None
    repository.next()
    robot.refuses(Attack.UNSIGNED)


def test_s14_root_of_the_same_number(robot: Robot, repository: Repository) -> None:
    repository.new_key("timestamp")
    repository.write_root()
    repository.files["metadata/2.root.json"] = repository.files["metadata/1.root.json"]
    robot.refuses(Attack.ROLLBACK)


def test_s14_root_signed_by_a_stranger(robot: Repository, repository: Repository) -> None:
    stranger = Repository()
    stranger.root.version = 2
    stranger.write_root()
    repository.files["metadata/2.root.json"] = stranger.files["metadata/2.root.json"]
    robot.refuses(Attack.UNSIGNED)


def test_s14_root_signed_by_one_key_of_threshold_two(robot: Robot, repository: Repository) -> None:
    second = CryptoSigner.generate_ed25519()
    repository.root.add_key(second.public_key, "root")
    repository.root.roles["root"].threshold = 2
    repository.root.version += 1
    repository.write_root(repository.signers["root"], second)
    assert robot.gets("hello", "1.0.0") == "1.0.0"
    repository.root.version += 1
    repository.write_root(second)
    robot.refuses(Attack.UNSIGNED)
    repository.write_root(repository.signers["root"], second)
    assert robot.gets() == "1.1.0"


def shift_clock(repository: Repository, by: timedelta) -> None:
    """The store's clock goes `by` ahead of the robot's."""
    repository.now += by
    for signed in repository.lists.values():
        signed.expires = repository.now + LASTS
    repository.next()


def test_s15_clock_ten_years_back_or_unset(robot: Robot, repository: Repository) -> None:
    shift_clock(repository, YEARS)
    robot.refuses(Attack.CLOCK)
    shift_clock(repository, -YEARS)
    assert robot.gets() == "1.1.0"


def test_s15_clock_ten_years_ahead(robot: Robot, repository: Repository) -> None:
    shift_clock(repository, -YEARS)
    robot.refuses(Attack.FREEZE)
    shift_clock(repository, YEARS)
    assert robot.gets() == "1.1.0"


def test_s15_clock_a_little_behind(robot: Robot, repository: Repository) -> None:
    shift_clock(repository, timedelta(minutes=50))
    assert robot.gets() == "1.1.0"


def test_s19_two_installations_of_one_rapp_at_once(robot: Robot, repository: Repository) -> None:
    second = Robot(repository, robot.home)  # another process would come so

    async def both() -> list[Installed]:
        return list(await asyncio.gather(robot.installs(), robot.installs(), second.installs(), second.installs()))

    done = asyncio.run(both())
    assert {item.version for item in done} == {"1.1.0"}
    assert [item.new for item in done].count(True) == 1
    names = sorted(path.name for path in (robot.home / "rapps" / "hello").iterdir())
    assert names == ["1.0.0", "1.1.0", "current", "previous"]
