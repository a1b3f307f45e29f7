"""The persons of a home, and whom each robot serves (deliverable §3.3). The database keeps them; callers read from memory.

A person is an account of role `user` that has a profile. A robot serves persons in an order; the first is the one it takes to
be present. All but `of` and `profile` is blocking.
"""

import logging
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain, count
from pathlib import Path

import sqlalchemy as sa

from rapp_cloud.accounts import Accounts
from rapp_cloud.database.marks import mark_of, raise_mark
from rapp_cloud.database.tables import accounts, contacts, people, served
from rapp_cloud.files import read_json
from rapp_cloud.profiles import MAX_BYTES, Contact, Profile, parse_profile
from rapp_hop.errors import HopError, Refused
from rapp_hop.hz.text import check_name

LANGUAGE = "en"  # of a robot that serves nobody yet
_MARK = "people"
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Person:
    """Somebody of the home."""

    person: str  # the account's name
    profile: Profile


class People:
    """The persons of one platform."""

    def __init__(self, known: Accounts) -> None:
        self._accounts = known
        self._database = known.database
        self._served: dict[str, tuple[Person, ...]] = {}  # by robot; replaced whole, never changed
        self._mark: int | None = None

    def of(self, robot: str) -> tuple[Person, ...]:
        """Return whom a robot serves, the one it takes to be present first."""
        return self._served.get(robot, ())

    def profile(self, robot: str, person: str | None = None) -> Profile:
        """Return the profile of one whom a robot serves; of a robot that serves nobody yet, one with its own name.

        :param person: by account or by name; None: the one it takes to be present
        :raises Refused: when the robot does not serve that person
        """
        mine = self.of(robot)
        if person is None:
            return mine[0].profile if mine else Profile(robot, LANGUAGE, ())
        for one in (*(one for one in mine if one.person == person), *(one for one in mine if one.profile.name == person)):
            return one.profile
        names = ", ".join(one.person for one in mine) or "nobody"
        raise Refused(f"cannot find {person[:70]!r}: {robot} serves {names}; ./rapp cloud person serve changes that")

    def refresh(self) -> None:
        """See what other processes have changed since; the first time, everything.

        :raises HopError: see `Database.reading`
        """
        with self._database.reading() as connection:
            mark = mark_of(connection, _MARK)
            if mark == self._mark:
                return
            known = {one.person: one for one in _all(connection)}
            rows = connection.execute(sa.select(served).order_by(served.c.robot, served.c.number)).all()
        found: dict[str, tuple[Person, ...]] = {}
        for row in rows:
            found[row.robot] = (*found.get(row.robot, ()), known[row.person])
        self._served, self._mark = found, mark

    def list(self) -> list[tuple[Person, list[str]]]:
        """Return all persons by account, each with the robots that serve them."""
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(served).order_by(served.c.robot)).all()
            return [(one, [row.robot for row in rows if row.person == one.person]) for one in _all(connection)]

    def add(self, person: str, profile: Profile, robots: Sequence[str] = ()) -> None:
        """Take a person in; these robots serve them too, from now on.

        :raises Refused: when the person is here already, or the name is another account's, or a robot is unknown
        """
        with self._changing() as connection:
            if _read(connection, person) is not None:
                raise Refused(f"cannot add {person}: this person is here already, edit them")
            self._put(connection, person, profile)
            for robot in robots:
                _serve(connection, robot, [*_served_by(connection, robot), person])

    def edit(self, person: str, change: Callable[[Profile], Profile]) -> Profile:
        """Change a profile; return what it is now.

        :raises Refused: when there is no such person
        :raises Invalid: when it is no right profile any more
        """
        with self._changing() as connection:
            found = _read(connection, person)
            if found is None:
                raise Refused(f"cannot find the person {person[:70]!r}: add them first")
            changed = change(found.profile)
            if not _forgets_only(changed, found.profile):
                changed = parse_profile(changed.describe())
            self._put(connection, person, changed)
        return changed

    def remove(self, person: str) -> bool:
        """Forget a person with account and tokens; return whether there was one."""
        with self._changing() as connection:
            if not connection.execute(sa.delete(people).where(people.c.person == person)).rowcount:
                return False
            self._accounts.close(connection, person)
            return True

    def serve(self, robot: str, persons: Sequence[str]) -> None:
        """Say whom a robot serves, the one it takes to be present first.

        :raises Refused: when robot or person is unknown
        """
        with self._changing() as connection:
            _serve(connection, robot, persons)

    def adopt(self, folder: Path) -> None:
        """Take over the files `<robot>.json` of an older platform; a broken one stays where it is, and is named."""
        for path in sorted(folder.glob("*.json")):
            try:
                robot = check_name(path.stem)
                self._adopt(robot, parse_profile(read_json(path, MAX_BYTES)))
            except HopError as error:
                _log.error("cannot take over %s: %s; correct it and start again", path, error)
            else:
                path.unlink(missing_ok=True)
                _log.info("people: %s taken over, which is gone", path.name)

    def _adopt(self, robot: str, profile: Profile) -> None:
        if profile == Profile(robot, LANGUAGE, ()):
            return  # what `init` wrote for a robot that serves nobody
        with self._changing() as connection:
            self._accounts.add_account(connection, robot, "robot")
            mine = _served_by(connection, robot)
            person = _free_name(connection, profile, mine)
            self._put(connection, person, profile)
            _serve(connection, robot, mine if person in mine else [*mine, person])

    def _put(self, connection: sa.Connection, person: str, profile: Profile) -> None:
        self._accounts.add_account(connection, person, "user")
        row = {"person": person, "name": profile.name, "language": profile.language}
        if not connection.execute(sa.update(people).where(people.c.person == person).values(row)).rowcount:
            connection.execute(sa.insert(people).values(row))
        connection.execute(sa.delete(contacts).where(contacts.c.person == person))
        rows = [
            {"person": person, "number": number, "name": one.name, "address": one.address}
            for number, one in enumerate(profile.contacts)
        ]
        if rows:
            connection.execute(sa.insert(contacts), rows)

    @contextmanager
    def _changing(self) -> Iterator[sa.Connection]:
        with self._database.writing() as connection:
            yield connection
            raise_mark(connection, _MARK)
        self.refresh()


def _all(connection: sa.Connection) -> list[Person]:
    written: dict[str, list[Contact]] = {}
    for row in connection.execute(sa.select(contacts).order_by(contacts.c.person, contacts.c.number)):
        written.setdefault(row.person, []).append(Contact(row.name, row.address))
    rows = connection.execute(sa.select(people).order_by(people.c.person))
    return [Person(row.person, Profile(row.name, row.language, tuple(written.get(row.person, ())))) for row in rows]


def _read(connection: sa.Connection, person: str) -> Person | None:
    return next((one for one in _all(connection) if one.person == person), None)


def _forgets_only(changed: Profile, profile: Profile) -> bool:
    """Whether there are only fewer contacts: so a profile is mended that an older platform took."""
    return changed == replace(profile, contacts=changed.contacts) and set(changed.contacts) < set(profile.contacts)


def _served_by(connection: sa.Connection, robot: str) -> list[str]:
    wanted = sa.select(served.c.person).where(served.c.robot == robot).order_by(served.c.number)
    return list(connection.execute(wanted).scalars())


def _serve(connection: sa.Connection, robot: str, persons: Sequence[str]) -> None:
    role = connection.execute(sa.select(accounts.c.role).where(accounts.c.name == robot)).scalar()
    if role != "robot":
        raise Refused(f"cannot find the robot {robot[:70]!r}: invite it first")
    known = set(connection.execute(sa.select(people.c.person)).scalars())
    if strange := [person for person in persons if person not in known]:
        raise Refused(f"cannot find the person {strange[0][:70]!r}: add them first")
    connection.execute(sa.delete(served).where(served.c.robot == robot))
    rows = [{"robot": robot, "person": person, "number": number} for number, person in enumerate(dict.fromkeys(persons))]
    if rows:
        connection.execute(sa.insert(served), rows)


def _free_name(connection: sa.Connection, profile: Profile, mine: Sequence[str]) -> str:
    """Return the account for a profile: one that is this very person's already, else a new one."""
    word = re.sub(r"[^a-z0-9]+", "_", profile.name.lower()).strip("_")[:50]
    begin = word if re.match("[a-z]", word) else "person"
    taken = set(connection.execute(sa.select(accounts.c.name)).scalars())
    known = {one.person: one.profile for one in _all(connection)}
    for name in chain([begin], (f"{begin}_{number}" for number in count(2))):
        if name not in taken or known.get(name) == profile or (name in mine and known[name].name == profile.name):
            return name
    raise AssertionError("numbers have no end")
