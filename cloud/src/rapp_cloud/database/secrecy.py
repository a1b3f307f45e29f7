"""How a PostgreSQL elsewhere is spoken to: with TLS, and only when its certificate says that it is the host of the URL."""

import os
from collections.abc import Iterable, Iterator

import sqlalchemy as sa

from rapp_cloud.tls import is_loopback
from rapp_hop.errors import Refused

STRICTEST = "verify-full"  # of libpq's sslmode: encrypted, the certificate trusted, its name the host's


def secrecy_of(url: sa.URL) -> dict[str, str]:
    """Return what libpq must be told beside the URL; nothing for a UNIX socket or a loopback address.

    :raises Refused: when the URL asks for less than that
    """
    elsewhere = [host for host in _hosts(url) if not (host.startswith(("/", "@")) or is_loopback(host))]
    if not elsewhere:
        return {}
    mode = url.query.get("sslmode", STRICTEST)
    if mode != STRICTEST:
        allowed = f"write sslmode={STRICTEST}, and sslrootcert=FILE when its certificate is one of your own making"
        raise Refused(f"cannot speak to the database at {elsewhere[0]} with sslmode={mode}: others could read or answer; {allowed}")
    return {"sslmode": STRICTEST}


def _hosts(url: sa.URL) -> Iterator[str]:
    """All that libpq may connect to; a service file may say anything, so its name stands for a host elsewhere."""
    if url.host:
        yield url.host
    for name in ("host", "hostaddr", "service"):
        given = [*_words(url, name)]
        yield from given
        usual = os.environ.get(f"PG{name.upper()}")
        if usual and not given and not (name == "host" and url.host):
            yield usual


def _words(url: sa.URL, name: str) -> Iterable[str]:
    """Return the hosts of a part of the query, which may be given several times and hold several, with their ports."""
    given = url.query.get(name, ())
    for text in (given,) if isinstance(given, str) else given:
        for word in text.split(","):
            yield word.partition(":")[0] if word.count(":") == 1 else word
