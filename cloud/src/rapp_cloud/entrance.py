"""`POST /join` (a robot's one-time code gives its token) and `POST /login` (a person's password gives one that ends)."""

import asyncio
import time

from rapp_cloud.admission import LOGIN, Admission
from rapp_cloud.audit import Audit
from rapp_hop import strict_json
from rapp_hop.errors import Invalid, Refused
from rapp_hop.fairness import Fairness
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer

MAX_BODY = 4096  # bytes
RATE, BURST = 0.5, 10.0  # tries per second of one address, and at once
HASHING = 2  # passwords checked at once: each costs memory and a processor
_JSON = "application/json"
_NO_STORE = (("Cache-Control", "no-store"),)


def entrance(admission: Admission, audit: Audit) -> list[Mount]:
    """Make the two; they are for strangers, so tries are few."""
    tries, places = Fairness(RATE, BURST, time.monotonic), asyncio.Semaphore(HASHING)

    async def join(visit: Visit) -> WireAnswer:
        (code,) = _read(visit, "code")
        tries.admit(visit.address)
        robot, token = await asyncio.to_thread(admission.join, code)
        audit.note(robot, "join", robot, address=visit.address)
        return _answer({"robot": robot, "token": token})

    async def login(visit: Visit) -> WireAnswer:
        name, password = _read(visit, "name", "password")
        tries.admit(visit.address)
        tries.admit(f"name {name[:100]}")
        async with places:
            token = await asyncio.to_thread(admission.log_in, name, password)
        audit.note(name, "login", name, address=visit.address)
        return _answer({"token": token, "seconds": LOGIN})

    pages = (("/join", join), ("/login", login))
    return [Mount(path, make, public=True, max_body=MAX_BODY, methods=frozenset({"POST"})) for path, make in pages]


def _read(visit: Visit, *names: str) -> list[str]:
    if visit.rest:
        raise Refused("cannot find this page: there are /join and /login", 404)
    given = strict_json.loads(bytes(visit.request.body), limit=MAX_BODY)
    if not isinstance(given, dict) or set(given) != set(names) or not all(isinstance(value, str) for value in given.values()):
        raise Invalid(f"cannot let you in: send a JSON object with {' and '.join(names)}")
    return [given[name] for name in names]


def _answer(value: object) -> WireAnswer:
    return WireAnswer(200, _JSON, strict_json.dumps(value).encode(), _NO_STORE)
