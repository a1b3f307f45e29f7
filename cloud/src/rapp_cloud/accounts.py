"""Who a token is: `tokens.json` maps each robot's secret token to its name (mode 0600, read again when it changes)."""

import hmac
import secrets
from pathlib import Path

from rapp_cloud.files import read_json, write_whole
from rapp_hop import strict_json
from rapp_hop.errors import Invalid
from rapp_hop.hz.text import check_name

MAX_BYTES = 2**20  # of tokens.json
MIN_TOKEN, MAX_TOKEN = 16, 256  # characters


class Accounts:
    """The tokens of one platform."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._seen: tuple[int, int] | None = None
        self._tokens: dict[bytes, str] = {}

    def robot_of(self, token: str | None) -> str | None:
        """Return the robot that a token names, or None. Its time does not depend on how much of a token is right.

        :raises Invalid: when tokens.json is broken
        """
        if token is None or not MIN_TOKEN <= len(token) <= MAX_TOKEN:
            return None
        self._reload()
        given = token.encode("utf-8", "replace")
        found = None
        for known, robot in self._tokens.items():
            if hmac.compare_digest(known, given):
                found = robot
        return found

    def add(self, robot: str) -> str:
        """Make a new token for a robot, keep it and return it."""
        token = secrets.token_urlsafe(32)
        known = self._read() if self._path.exists() else {}
        self._path.parent.mkdir(parents=True, exist_ok=True)
        text = strict_json.dumps({**known, token: check_name(robot)})
        write_whole(self._path, text.encode(), mode=0o600)
        return token

    def _reload(self) -> None:
        try:
            status = self._path.stat()
        except OSError:
            self._tokens, self._seen = {}, None
            return
        if (status.st_mtime_ns, status.st_ino) != self._seen:
            self._tokens = {token.encode(): robot for token, robot in self._read().items()}
            self._seen = (status.st_mtime_ns, status.st_ino)

    def _read(self) -> dict[str, str]:
        found = read_json(self._path, MAX_BYTES)
        if not isinstance(found, dict) or not all(isinstance(robot, str) for robot in found.values()):
            raise Invalid("cannot read tokens.json: it must map tokens to names of robots")
        if any(not MIN_TOKEN <= len(token) <= MAX_TOKEN for token in found):
            raise Invalid(f"cannot read tokens.json: a token must have {MIN_TOKEN} to {MAX_TOKEN} characters")
        return {token: check_name(robot) for token, robot in found.items()}
