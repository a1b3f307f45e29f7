"""The system in containers: one platform with its mail server, two robots on networks of their own (docker/compose.yaml)."""

import mailbox
import ssl
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from email.message import Message
from itertools import count
from pathlib import Path
from typing import IO

import pytest

from fakes.containers import Composition, engine_environment
from fakes.processes import ended

pytestmark = [pytest.mark.system, pytest.mark.timeout(1500)]
ROBOTS = ("nao1", "nao2")
SERVICES = ("cloud", "mail", *ROBOTS)
REACHES = "import socket, sys; socket.create_connection((sys.argv[1], int(sys.argv[2])), 3)"
PYTHON = ".venv/bin/python"


@pytest.fixture(scope="module")
def composition() -> Iterator[Composition]:
    made = Composition(engine_environment())
    try:
        made.compose("build", timeout=800)
        made.compose("up", "-d")
        made.healthy(*SERVICES)
        yield made
    finally:
        made.compose("down", "--volumes", "--timeout", "30")


def say(composition: Composition, robot: str, *words: str) -> str:
    """Somebody in the robot's room says one thing after another; gives what was shown, once the robot listens again."""
    said = composition.inside(robot, "./rapp", "say", *words, "--home", "/robot", "--timeout", "400", timeout=420)
    assert said.returncode == 0, f"{said.stdout}\n{said.stderr}\n{composition.logs()}"
    return said.stdout


def send(composition: Composition, robot: str, message: str) -> None:
    """Somebody sends Elizabeth a mail, and hears that it is sent."""
    shown = say(composition, robot, "e-mail", "Elizabeth", message)
    assert "your message to Elizabeth is sent" in shown, f"{shown}\n{composition.logs()}"


def on_both(composition: Composition, *words: str) -> dict[str, str]:
    """The same is said to both robots at once."""
    told: dict[str, str] = {}

    def on(robot: str) -> None:
        told[robot] = say(composition, robot, *words)

    people = [threading.Thread(target=on, args=(robot,)) for robot in ROBOTS]
    for person in people:
        person.start()
    for person in people:
        person.join()
    return told


def mails(composition: Composition, folder: Path) -> list[Message]:
    """What the mail server has delivered."""
    folder.mkdir()
    composition.docker("cp", f"{composition.container('mail')}:/mail", str(folder))
    return list(mailbox.Maildir(folder / "mail", create=False))


def subjects(found: list[Message]) -> list[str]:
    return sorted(str(message["From"]) for message in found)


def test_each_container_is_unprivileged_and_only_the_platform_is_public(composition: Composition, tmp_path: Path) -> None:
    for service in SERVICES:
        known = composition.inspect(service)
        assert known["HostConfig"]["Privileged"] is False
        assert known["Config"]["User"] == "rapp"
        assert not any("docker.sock" in mount["Source"] for mount in known["Mounts"])
        published = [port for port, there in known["NetworkSettings"]["Ports"].items() if there]
        assert published == (["9001/tcp"] if service == "cloud" else [])
    composition.docker("cp", f"{composition.container('cloud')}:/data/tls/certificate.pem", str(tmp_path))
    trust = ssl.create_default_context(cafile=str(tmp_path / "certificate.pem"))
    platform = f"https://127.0.0.1:{composition.port}"
    assert urllib.request.urlopen(f"{platform}/tuf/metadata/timestamp.json", timeout=10, context=trust).status == 200
    with pytest.raises(urllib.error.HTTPError, match="401"):
        urllib.request.urlopen(f"{platform}/hop/list_rapps", timeout=10, context=trust)


def test_the_robots_reach_the_platform_and_not_each_other(composition: Composition) -> None:
    other = composition.inspect("nao2")["NetworkSettings"]["Networks"][f"{composition.project}_two"]["IPAddress"]
    assert composition.inside("nao1", PYTHON, "-c", REACHES, "cloud", "9001").returncode == 0
    assert composition.inside("nao2", PYTHON, "-c", REACHES, "cloud", "9001").returncode == 0
    assert composition.inside("nao1", PYTHON, "-c", REACHES, other, "9090").returncode != 0
    assert composition.inside("nao1", PYTHON, "-c", REACHES, "nao2", "9090").returncode != 0


def test_voice_mail_on_both_robots_at_once(composition: Composition, tmp_path: Path) -> None:
    told = on_both(composition, "e-mail", "Elizabeth", "please bring some water")
    assert all("your message to Elizabeth is sent" in told.get(robot, "") for robot in ROBOTS), told
    found = mails(composition, tmp_path / "mails")
    assert subjects(found) == ["nao1@home.example", "nao2@home.example"]
    assert all(any(part.get_filename("").endswith(".ogg") for part in message.walk()) for message in found)


def test_hazard_detection_on_both_robots_at_once(composition: Composition) -> None:
    told = on_both(composition, "is everything safe", "no")
    for robot in ROBOTS:
        shown = told.get(robot, "")
        assert "the door is open" in shown, shown
        assert "the lamp is on" in shown, shown
        assert "I write to nobody" in shown, shown


def test_a_robot_cut_off_in_the_middle_keeps_its_mail_and_sends_it_once_healed(composition: Composition, tmp_path: Path) -> None:
    before = len(mails(composition, tmp_path / "before"))
    words = ["./rapp", "say", "e-mail", "Elizabeth", "this one has to wait", "--home", "/robot"]
    with composition.begin("nao1", *words) as talk:
        assert talk.stdout is not None
        shown = until_state(talk.stdout, "s34")
        composition.network("disconnect", "nao1", "one")
        try:
            shown += talk.stdout.read()
            assert talk.wait(180) == 0, shown
            assert "is sent”" not in shown
            send(composition, "nao2", "this one has not")
            assert len(mails(composition, tmp_path / "meanwhile")) == before + 1
        finally:
            composition.network("connect", "nao1", "one")
    looks = count()
    composition.until(lambda: len(mails(composition, tmp_path / f"look{next(looks)}")) > before + 1, "the mail that waited")
    send(composition, "nao1", "this one comes after it")
    assert len(mails(composition, tmp_path / "after")) == before + 3


def until_state(lines: IO[str], state: str) -> str:
    """Read what is shown until an agent has entered a state."""
    shown = ""
    for line in lines:
        shown += line
        if f" {state} " in line:
            return shown
    raise AssertionError(f"no {state} in:\n{shown}")


@pytest.mark.parametrize("service", SERVICES)
def test_a_container_that_is_killed_serves_again_once_it_is_started(composition: Composition, tmp_path: Path, service: str) -> None:
    before = len(mails(composition, tmp_path / "before"))
    composition.compose("kill", service)
    composition.compose("start", service)
    composition.healthy(*SERVICES)
    send(composition, "nao1", f"{service} is back")
    assert len(mails(composition, tmp_path / "after")) == before + 1


def test_nothing_is_left_when_it_is_taken_down(composition: Composition) -> None:
    processes = {composition.inspect(service)["State"]["Pid"] for service in SERVICES}
    composition.compose("down", "--volumes", "--timeout", "30", timeout=120)
    assert composition.left() == {"container": [], "volume": [], "network": []}
    assert not [pid for pid in processes if not ended(pid)]
