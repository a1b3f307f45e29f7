"""The platform is away, or answers wrongly, whenever a robot needs it: that is said aloud, and the robot listens again."""

from collections.abc import Iterator

import pytest

from fakes import faulty_cloud
from fakes.faulty_cloud import Fault
from fakes.rapps import install_rapp, write_rapp
from fakes.robot_behind_faults import RobotBehindFaults
from fakes.whole_robot import entered, processes_of

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

AWAY = "I cannot reach the platform"
ODD = "The platform does not answer as it should"
LONG, BROKEN, CHANGED = (
    f"I refuse to install fresh, {why}"
    for why in ("it is longer than it should be", "the store's lists are broken", "it was changed on its way")
)
METADATA, TARGETS = "/tuf/metadata/timestamp.json", "/tuf/targets/"
QUICK = """
register_again = 1.0
register_timeout = 2.0
catalogue_again = 1.0
interpret_timeout = 3.0
install_timeout = 3.0
cloud_call_timeout = 2.0
"""
INSTALLED_SLOWLY = 400  # files of a package that takes a moment to unpack


def say(words: str) -> str:
    return f"communication.rapp_say({words!r})"


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RobotBehindFaults]:
    """A robot that has been started while the platform was away, and has met it since."""
    folder = tmp_path_factory.mktemp("platform")
    fresh = write_rapp(folder / "fresh", "fresh", say("fresh"))
    large = write_rapp(folder / "large", "large", say("large"))
    for number in range(INSTALLED_SLOWLY):
        (large / f"{number}.txt").write_text(str(number))
    permissions = {"core": ["rapp_say"], "cloud": ["profile"]}
    caller = write_rapp(folder / "caller", "caller", "cloud.call_wait('profile')", permissions=permissions)
    robot = RobotBehindFaults(folder, [fresh, large, caller])
    robot.settings = QUICK
    install_rapp(robot.home, "old", say("old"))
    try:
        robot.start("roscore", "cloud", "nao_sim", "rosbridge")
        robot.stop("cloud")
        robot.start("link", "core_agent")
        robot.served("old", "old")
        robot.start("cloud")
        robot.until(lambda seen: seen.detail == "link->core reply register")
        yield robot
    finally:
        robot.close()
    assert processes_of(folder) == []


def begin(robot: RobotBehindFaults) -> int:
    """The state before a case: nothing is wrong, and `fresh` has to be downloaded."""
    robot.cloud_line.mend()
    robot.forget("fresh")
    for part in (robot.home / "downloads").glob("*"):
        part.unlink()
    return len(robot.seen)


def test_away_at_start_it_listens_runs_what_is_installed_and_registers_later(robot: RobotBehindFaults) -> None:
    happened = [seen.detail for seen in robot.seen if seen.kind in ("said", "message")]
    assert happened.index("old") < happened.index("link->core reply register")
    robot.forget("fresh")
    robot.served("fresh", "fresh")


def test_away_while_the_list_comes(robot: RobotBehindFaults) -> None:
    since = begin(robot)
    robot.cloud_line.set("/hop/list_rapps", faulty_cloud.silent)
    robot.cloud_line.wait_reached()
    robot.kill("cloud")
    robot.cloud_line.mend()
    robot.served("old", "old")
    assert not any(entered("s11")(seen) for seen in robot.seen[since:])
    robot.start("cloud")
    robot.served("fresh", "fresh")


@pytest.mark.parametrize(
    ("prefix", "fault"),
    [(METADATA, faulty_cloud.silent), (TARGETS, faulty_cloud.half)],
    ids=["the lists' signatures", "half of the package"],
)
def test_away_in_a_download(robot: RobotBehindFaults, prefix: str, fault: Fault) -> None:
    since = begin(robot)
    robot.cloud_line.set(prefix, fault)
    robot.ask("fresh", "s6")
    robot.cloud_line.wait_reached()
    robot.kill("cloud")
    robot.cloud_line.mend()
    assert robot.refused(since) == AWAY
    assert all(path.suffix == ".part" for path in (robot.home / "downloads").glob("*"))
    since = len(robot.seen)
    robot.ask("fresh", "s6")
    assert robot.refused(since) == AWAY, "it is still away"
    robot.start("cloud")
    robot.served("fresh", "fresh")


def test_away_once_a_package_is_verified_it_is_installed_and_runs(robot: RobotBehindFaults) -> None:
    since = begin(robot)
    robot.ask("large", "s6")
    robot.until(lambda seen: seen.detail == "link->core verified (asynchronous)", since)
    robot.kill("cloud")
    robot.until(lambda seen: (seen.kind, seen.detail) == ("said", "large"), since)
    robot.until_listening(robot.seen.index(robot.until(entered("s10"), since)))
    robot.start("cloud")
    begin(robot)
    robot.served("fresh", "fresh")


FAULTS: dict[str, Fault] = {
    "slow": faulty_cloud.slow,
    "cut": faulty_cloud.cut,
    "too long": faulty_cloud.too_long,
    "no JSON": faulty_cloud.no_json,
    "500": faulty_cloud.error_500,
}
CASES = [
    (METADATA, {"slow": AWAY, "cut": AWAY, "too long": LONG, "no JSON": BROKEN, "500": AWAY}),
    (TARGETS, {"slow": AWAY, "cut": AWAY, "too long": LONG, "no JSON": CHANGED, "500": AWAY}),
]


@pytest.mark.parametrize(
    ("prefix", "fault", "words"),
    [pytest.param(prefix, fault, said, id=f"{prefix} {fault}") for prefix, row in CASES for fault, said in row.items()],
)
def test_a_store_that_answers_wrongly(robot: RobotBehindFaults, prefix: str, fault: str, words: str) -> None:
    since = begin(robot)
    robot.cloud_line.set(prefix, FAULTS[fault])
    robot.ask("fresh", "s6")
    assert robot.refused(since) == words
    assert not (robot.home / "rapps" / "fresh").exists()
    robot.cloud_line.mend()
    robot.served("fresh", "fresh")


@pytest.mark.parametrize(
    ("fault", "words"), [("slow", AWAY), ("cut", AWAY), ("no JSON", ODD), ("500", ODD)], ids=lambda value: value
)
def test_an_interpreter_that_answers_wrongly(robot: RobotBehindFaults, fault: str, words: str) -> None:
    begin(robot)
    robot.cloud_line.set("/hop/interpret", FAULTS[fault])
    since = robot.command("would you be so kind and run the fresh one")
    assert robot.refused(since) == words
    robot.cloud_line.mend()


@pytest.mark.parametrize("fault", FAULTS)
def test_a_service_that_answers_a_dynamic_agent_wrongly(robot: RobotBehindFaults, fault: str) -> None:
    since = begin(robot)
    robot.cloud_line.set("/hop/profile", FAULTS[fault])
    robot.ask("caller")
    assert robot.refused(since) == "It has failed"
    robot.cloud_line.mend()


@pytest.mark.parametrize("fault", FAULTS)
def test_a_list_that_is_wrong_does_not_disturb(robot: RobotBehindFaults, fault: str) -> None:
    since = begin(robot)
    robot.cloud_line.set("/hop/list_rapps", FAULTS[fault])
    robot.cloud_line.wait_reached()
    robot.served("old", "old")
    assert "s11" not in {seen.state for seen in robot.seen[since:]}
    robot.cloud_line.mend()
