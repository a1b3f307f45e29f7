"""Who may do what: tokens, and the topics, services and parameters that each of them opens. Pure.

Rules kept here: a client without a token that is known gets nothing; a name is checked as it is resolved, not as it is
written; what an entry does not list is not allowed.
"""

import hashlib
import hmac
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import Any

from rapp_bridge.errors import Invalid, Refused
from rapp_bridge.protocol import Auth

SKEW = 5  # s between a digest's time and ours, either way; rosauth's own limit
MACS_KEPT = 10_000  # digests remembered, so that none is used twice


@dataclass(frozen=True)
class Access:
    """What one client may use; each is a list of globs ("*" also crosses slashes), compared with resolved names."""

    name: str
    topics: tuple[str, ...] = ("*",)
    services: tuple[str, ...] = ("*",)
    params: tuple[str, ...] = ("*",)

    def topic(self, name: str) -> None:
        """Raise Refused unless this topic may be used."""
        self._check("topic", self.topics, name)

    def service(self, name: str) -> None:
        """Raise Refused unless this service may be called or offered; rosapi's own may be called by all."""
        if not name.startswith("/rosapi/"):
            self._check("service", self.services, name)

    def offer(self, name: str) -> None:
        """Raise Refused unless this service may be offered."""
        self._check("service", self.services, name)

    def param(self, name: str) -> None:
        """Raise Refused unless this parameter may be read and written."""
        self._check("parameter", self.params, name)

    def _check(self, kind: str, globs: tuple[str, ...], name: str) -> None:
        if not matches(globs, name):
            raise Refused(f"cannot use {kind} {name}: {self.name} may not; ask whoever gave you the token")


@lru_cache(8192)
def matches(globs: tuple[str, ...], name: str) -> bool:
    """Whether one of the globs fits the name."""
    return any(fnmatchcase(name, glob) for glob in globs)


EVERYTHING = Access("everybody")


@dataclass
class Gate:
    """Lets clients in by their tokens; without tokens everybody is let in, to everything."""

    tokens: Mapping[str, Access] = field(default_factory=dict)
    now: Callable[[], float] = lambda: 0.0  # seconds since the epoch, as the clients' own
    _used: dict[str, float] = field(default_factory=dict)  # digest to when it ends

    @property
    def is_open(self) -> bool:
        """Whether no token is needed."""
        return not self.tokens

    def by_token(self, token: str) -> Access:
        """Who has this token; raises Refused."""
        found = None
        for known, access in self.tokens.items():  # all of them, so that the time taken tells nothing
            if hmac.compare_digest(known.encode(), token.encode(errors="replace")):
                found = access
        if found is None:
            raise Refused("cannot let you in: the token is not known")
        return found

    def by_auth(self, auth: Auth) -> Access:
        """Who sent this auth message; raises Refused."""
        return self.by_token(auth.token) if auth.token else self._by_mac(auth)

    def _by_mac(self, auth: Auth) -> Access:
        now = self.now()
        if abs(now - auth.t) > SKEW or auth.end < now:
            raise Refused("cannot let you in: the auth message is not of this moment; set the clock")
        fields = f"{auth.client}{auth.dest}{auth.rand}{auth.t}{auth.level}{auth.end}"
        found = None
        for token, access in self.tokens.items():
            digest = hashlib.sha512((token + fields).encode(errors="replace")).hexdigest()
            if hmac.compare_digest(digest.encode(), auth.mac.lower().encode(errors="replace")):
                found = access
        if found is None:
            raise Refused("cannot let you in: the digest (mac) is of no token that is known")
        self._use_once(auth.mac.lower(), now)
        return found

    def _use_once(self, mac: str, now: float) -> None:
        if self._used.get(mac, 0.0) > now or len(self._used) >= MACS_KEPT:
            self._used = {old: end for old, end in self._used.items() if end > now}
            if mac in self._used or len(self._used) >= MACS_KEPT:
                raise Refused("cannot let you in: this auth message was used before; make a new one")
        self._used[mac] = now + 2 * SKEW


def read_tokens(text: str) -> dict[str, Access]:
    """The tokens of an access file (TOML); raises Invalid. One table for each client:

    [clients.browser]
    token = "..."              # at least 16 characters
    topics = ["/camera/*"]     # globs; what is left out is not allowed
    services = ["/rapp_say"]
    params = []
    """
    try:
        clients = tomllib.loads(text).get("clients", {})
    except tomllib.TOMLDecodeError as error:
        raise Invalid(f"cannot read the access file: {error}") from error
    if not isinstance(clients, dict) or not clients:
        raise Invalid("cannot use the access file: it has no [clients.NAME]; add one, or start without the file")
    tokens: dict[str, Access] = {}
    for name, entry in clients.items():
        token, access = _entry(name, entry)
        if token in tokens:
            raise Invalid(f"cannot use the access file: {name} has the token of {tokens[token].name}")
        tokens[token] = access
    return tokens


def _entry(name: str, entry: Any) -> tuple[str, Access]:
    kinds = ("topics", "services", "params")
    if not isinstance(entry, dict) or not entry.keys() <= {"token", *kinds}:
        raise Invalid(f"cannot use the access file: {name} is to have token, {', '.join(kinds)} and nothing else")
    token = entry.get("token")
    if not isinstance(token, str) or len(token) < 16:
        raise Invalid(f"cannot use the access file: the token of {name} is to have 16 characters or more")
    lists = [entry.get(kind, []) for kind in kinds]
    if not all(isinstance(globs, list) and all(isinstance(glob, str) for glob in globs) for globs in lists):
        raise Invalid(f"cannot use the access file: {', '.join(kinds)} of {name} are to be lists of globs")
    topics, services, params = map(tuple, lists)
    return token, Access(name, topics, services, params)
