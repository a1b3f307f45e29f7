"""Persons of a home and the robots that serve them, on both databases; and at the platform's port."""

import asyncio
import json
import sqlite3
import time
from dataclasses import replace
from pathlib import Path

import pytest
import sqlalchemy as sa

from fakes.cloud_process import cloud_process
from rapp_cli.__main__ import main as rapp
from rapp_cloud.accounts import Accounts
from rapp_cloud.admission import Admission
from rapp_cloud.database.engine import FILE, Database
from rapp_cloud.database.tables import contacts
from rapp_cloud.memory import open_memory
from rapp_cloud.people import People
from rapp_cloud.profiles import Contact, Profile
from rapp_hop.client import HopClient
from rapp_hop.errors import Invalid, Refused

PATIENCE = 30.0  # s
ELIZABETH, NOWAK = Contact("Elizabeth", "elizabeth@home.example"), Contact("Doctor Nowak", "nowak@clinic.example")
MARIA, JAN = Profile("Maria", "en", (ELIZABETH, NOWAK)), Profile("Jan", "pl", (NOWAK,))


@pytest.fixture
def accounts(database: Database) -> Accounts:
    accounts = Accounts(database)
    for robot in ("nao", "other"):
        accounts.open(robot, "robot")
    return accounts


@pytest.fixture
def people(accounts: Accounts) -> People:
    people = People(accounts)
    people.add("maria", MARIA, ["nao"])
    people.add("jan", JAN, ["nao", "other"])
    return people


def test_a_robot_knows_those_whom_it_serves(people: People) -> None:
    assert [one.person for one in people.of("nao")] == ["maria", "jan"]
    assert people.profile("nao") == people.profile("nao", "maria") == people.profile("nao", "Maria") == MARIA
    assert people.profile("nao", "jan") == people.profile("other") == JAN
    for stranger in ("Maria", "maria", "nobody", ""):
        with pytest.raises(Refused, match="other serves jan"):
            people.profile("other", stranger)
    assert people.profile("third") == Profile("third", "en", ())


def test_who_is_present_is_said_by_order(people: People) -> None:
    people.serve("nao", ["jan", "maria", "jan"])
    assert people.profile("nao") == JAN
    people.serve("nao", [])
    assert people.of("nao") == ()
    for robot, person in (("maria", "jan"), ("nothing", "jan"), ("nao", "nobody"), ("nao", "other")):
        with pytest.raises(Refused, match="cannot find the"):
            people.serve(robot, [person])


def test_what_is_changed_here_is_seen_there(people: People, database: Database) -> None:
    there = People(Accounts(database))
    there.refresh()
    assert there.profile("nao") == MARIA
    assert people.edit("maria", lambda profile: replace(profile, language="de", contacts=(NOWAK,))).language == "de"
    assert there.profile("nao") == MARIA
    there.refresh()
    assert there.profile("nao") == Profile("Maria", "de", (NOWAK,))
    assert [(one.person, robots) for one, robots in there.list()] == [("jan", ["nao", "other"]), ("maria", ["nao"])]


def test_what_is_wrong_changes_nothing(people: People) -> None:
    for change in (
        lambda profile: replace(profile, contacts=(Contact("Eve", "eve@x\nBcc: all@x"),)),
        lambda profile: replace(profile, name=""),
        lambda profile: replace(profile, language="x" * 17),
    ):
        with pytest.raises(Invalid):
            people.edit("maria", change)
    with pytest.raises(Refused, match="here already"):
        people.add("jan", MARIA)
    with pytest.raises(Refused, match="choose another name"):
        people.add("nao", MARIA)
    with pytest.raises(Refused, match="cannot find the robot"):
        people.add("eve", MARIA, ["nothing"])
    with pytest.raises(Refused, match="add them first"):
        people.edit("eve", lambda profile: profile)
    assert [one.person for one, _ in people.list()] == ["jan", "maria"]
    assert people.profile("nao") == MARIA


def test_a_profile_that_an_older_platform_took_is_mended_by_forgetting(people: People) -> None:
    unnamed, again = Contact("...", "x@home.example"), Contact("elizabeth", "other@home.example")
    people.add("eve", Profile("Eve", "en", (ELIZABETH, unnamed, again)))
    for left in ((ELIZABETH, again), (ELIZABETH,)):
        with pytest.raises(Invalid):
            people.edit("eve", lambda profile: replace(profile, language="de"))
        with pytest.raises(Invalid):
            people.edit("eve", lambda profile, left=left: replace(profile, contacts=left, name=""))
        people.edit("eve", lambda profile, left=left: replace(profile, contacts=left))
    assert people.edit("eve", lambda profile: replace(profile, language="de")).contacts == (ELIZABETH,)


def test_who_goes_takes_account_tokens_and_contacts_along(people: People, accounts: Accounts, database: Database) -> None:
    admission = Admission(accounts)
    admission.enrol("maria", "user", "correct horse")
    token = admission.log_in("maria", "correct horse")
    assert accounts.name_of(token) == "maria"
    assert people.remove("maria")
    assert not people.remove("maria") and not people.remove("nao")
    accounts.refresh()
    assert accounts.name_of(token) is None
    with pytest.raises(Refused, match="name or password is wrong"):
        admission.log_in("maria", "correct horse")
    assert people.profile("nao") == JAN
    with database.reading() as connection:
        assert set(connection.execute(sa.select(contacts.c.person)).scalars()) == {"jan"}
    people.add("maria", JAN)
    accounts.refresh()
    assert accounts.name_of(token) is None


def _write(folder: Path, robot: str, value: object) -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / f"{robot}.json"
    path.write_text(value if isinstance(value, str) else json.dumps(value))
    return path


def test_the_profile_files_of_an_older_platform_are_taken_over(accounts: Accounts, tmp_path: Path) -> None:
    people, folder = People(accounts), tmp_path / "profiles"
    accounts.open("jan", "publisher")
    for robot, profile in (("nao", MARIA), ("other", MARIA), ("third", replace(MARIA, contacts=()))):
        _write(folder, robot, profile.describe())
    _write(folder, "fourth", JAN.describe())
    _write(folder, "fifth", Profile("Łucja", "pl", ()).describe())
    _write(folder, "sixth", Profile("sixth", "en", ()).describe())
    broken = [_write(folder, "seventh", "{"), _write(folder, "Eighth", MARIA.describe())]
    people.adopt(folder)
    served = {robot: [one.person for one in people.of(robot)] for robot in ("nao", "other", "third", "fourth", "fifth", "sixth")}
    assert served == {
        "nao": ["maria"], "other": ["maria"], "third": ["maria_2"], "fourth": ["jan_2"], "fifth": ["ucja"], "sixth": [],
    }  # fmt: skip
    assert people.profile("nao") == MARIA and people.profile("fourth") == JAN
    assert people.profile("sixth") == Profile("sixth", "en", ())
    assert sorted(folder.iterdir()) == sorted(broken)
    broken[0].write_text(json.dumps(MARIA.describe()))
    _write(folder, "fourth", replace(JAN, language="en").describe())
    people.adopt(folder)
    assert [one.person for one in people.of("seventh")] == ["maria"]
    assert [one.person for one in people.of("fourth")] == ["jan_2"]
    assert people.profile("fourth").language == "en"


def test_an_upgrade_loses_no_profile(database_url: str, tmp_path: Path) -> None:
    """Tables as the version before has left them, and the file of a robot."""
    database = Database(database_url)
    database.migrate("0002")
    with database.writing() as connection:
        connection.execute(sa.text("INSERT INTO accounts (name, role, created) VALUES ('nao', 'robot', 1)"))
    database.close()
    file = _write(tmp_path / "profiles", "nao", MARIA.describe())
    with open_memory(tmp_path, database_url) as memory:
        assert memory.people.profile("nao") == MARIA
    assert not file.exists()
    with open_memory(tmp_path, database_url) as memory:
        assert memory.people.profile("nao") == MARIA


def test_a_rapp_gets_the_persons_of_its_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with cloud_process(tmp_path, []) as cloud:

        def person(*words: str) -> str:
            assert rapp(["cloud", "--data", str(cloud.data), "person", *words]) == 0
            return capsys.readouterr().out

        async def test(nao: HopClient, other: HopClient) -> None:
            lock = sqlite3.connect(cloud.data / FILE, isolation_level=None)
            lock.execute("BEGIN EXCLUSIVE")  # whoever asks for a profile does not wait for the database
            assert await nao.call("profile") == {"name": "nao", "language": "en", "contacts": []}
            assert await nao.call("people") == {"people": []}
            lock.close()
            person("add", "maria", "--name", "Maria", "--robot", "nao")
            person("contact", "maria", "Elizabeth", "e@home.example")
            person("contact", "maria", "Elizabeth", "elizabeth@home.example")
            person("add", "jan", "--name", "Jan", "--robot", "nao")
            maria = {"name": "Maria", "language": "en", "contacts": [{"name": "Elizabeth", "address": "elizabeth@home.example"}]}
            jan = {"name": "Jan", "language": "en", "contacts": []}
            deadline = time.monotonic() + PATIENCE
            while len((await nao.call("people"))["people"]) < 2:
                assert time.monotonic() < deadline
                await asyncio.sleep(0.05)
            assert await nao.call("profile", {"robot": "nao"}) == await nao.call("profile", {"person": "maria"}) == maria
            assert await nao.call("profile", {"person": "Jan"}) == jan
            assert (await nao.call("people"))["people"][0] == {"person": "maria", "name": "Maria", "language": "en"}
            for arguments in ({"person": "maria"}, {"robot": "nao"}, {"robot": "nao", "person": "maria"}):
                with pytest.raises(Refused) as caught:
                    await other.call("profile", arguments)
                assert "elizabeth" not in str(caught.value).lower()
            assert await other.call("people") == {"people": []}

        cloud.run(test)
        shown = person("show", "maria")
        assert "served by nao" in shown and "elizabeth@home.example" in shown
        assert person("serve", "nao", "jan", "jan").strip() == "nao serves jan"
        person("edit", "jan", "--language", "pl")
        person("forget", "maria", "Elizabeth")
        person("remove", "maria")
        assert person("show").split() == ["jan", "Jan", "pl", "nao"]
        assert rapp(["cloud", "--data", str(cloud.data), "person", "show", "maria"]) == 1
        assert "cannot find the person" in capsys.readouterr().err
        with open_memory(cloud.data) as memory:
            assert ("person remove", "maria") in [(entry.deed, entry.subject) for entry in memory.audit.entries()]
