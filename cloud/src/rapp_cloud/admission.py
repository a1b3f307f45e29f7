"""How somebody gets a token: a robot by a one-time code, a person by a password. Blocking.

A code carries the hash of the store's root, so what a robot trusts does not rest on the way to the platform: who has the code
on a way that is trusted knows the right root.
"""

import functools
import hashlib
import secrets

import sqlalchemy as sa
from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from rapp_cloud.accounts import Accounts, hash_of
from rapp_cloud.database.tables import accounts, codes
from rapp_hop.errors import Refused
from rapp_hop.hz.text import check_name

SHORTEST_PASSWORD, LONGEST_PASSWORD = 10, 200  # characters
LOGIN = 12 * 3600.0  # seconds that a person's token is good
ROOT_DIGITS = 32  # of the root's SHA-256, in a code
_hasher = PasswordHasher()


class Admission:
    """The door of one platform."""

    def __init__(self, known: Accounts) -> None:
        self._accounts = known
        self._database = known.database

    def invite(self, robot: str, life: float, root: bytes) -> str:
        """Make a code by which one robot may come in, once; return it.

        :param life: seconds
        :param root: the store's root.json
        """
        self._accounts.open(check_name(robot), "robot")
        secret, until = secrets.token_hex(10), self._accounts.clock() + life
        with self._database.writing() as connection:
            connection.execute(sa.insert(codes).values(hash=hash_of(secret), robot=robot, expires=until))
        return f"{secret}-{hashlib.sha256(root).hexdigest()[:ROOT_DIGITS]}"

    def join(self, code: str) -> tuple[str, str]:
        """Redeem a code; return the robot's name and its token.

        :raises Refused: when it is none, was used before or is too old; all the same to a stranger
        """
        mine, now = codes.c.hash == hash_of(code.partition("-")[0]), self._accounts.clock()
        with self._database.writing() as connection:
            robot: str | None = connection.execute(sa.select(codes.c.robot).where(mine)).scalar()
            free = sa.update(codes).where(mine, codes.c.used.is_(None), codes.c.expires > now).values(used=now)
            if robot is None or not connection.execute(free).rowcount:
                raise Refused("cannot let this robot in: the code is wrong, used or too old; ask for a new one", 401)
            token = self._accounts.add_token(connection, robot)
        self._accounts.refresh()
        return robot, token

    def enrol(self, name: str, role: str, password: str) -> None:
        """Make a person's account, or give it another password.

        :raises Refused: when the password is too short, or the name is somebody else's
        """
        if not SHORTEST_PASSWORD <= len(password) <= LONGEST_PASSWORD:
            raise Refused(f"cannot use this password: it must have {SHORTEST_PASSWORD} to {LONGEST_PASSWORD} characters")
        self._accounts.open(name, role, _hasher.hash(password))

    def log_in(self, name: str, password: str) -> str:
        """Return a token for whoever knows the password of an account. A wrong name takes as long as a wrong password.

        :raises Refused: when name or password is wrong
        """
        with self._database.reading() as connection:
            kept = connection.execute(sa.select(accounts.c.password).where(accounts.c.name == name)).scalar()
        try:
            _hasher.verify(kept or _nobody(), password[:LONGEST_PASSWORD])
        except (VerificationError, InvalidHashError):
            kept = None
        if kept is None:
            raise Refused("cannot let you in: name or password is wrong", 401)
        return self._accounts.give(name, life=LOGIN)


@functools.cache
def _nobody() -> str:
    """A hash that no password has been made of."""
    return _hasher.hash(secrets.token_hex(16))
