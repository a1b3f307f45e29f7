"""S14, S15 and S19 of the list of attacks on store and metadata: roots, clocks, two installations at once."""

import asyncio
from datetime import timedelta

from securesystemslib.signer import CryptoSigner

from fakes.repository import LASTS, Repository
from fakes.store_robot import YEARS, Robot
from rapp_hop.hz.install import Installed
from rapp_hop.hz.trust import Attack


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
