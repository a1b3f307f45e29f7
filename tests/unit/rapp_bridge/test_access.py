import hashlib

import pytest

from rapp_bridge.access import EVERYTHING, SKEW, Access, Gate, read_tokens
from rapp_bridge.errors import Invalid, Refused
from rapp_bridge.protocol import Auth

TOKEN, OTHER = "a-long-secret-token", "another-long-secret"
BROWSER = Access("browser", ("/camera/*", "/chat"), ("/rapp_say",), ("/limits/*",))


@pytest.fixture
def gate() -> Gate:
    return Gate({TOKEN: BROWSER, OTHER: EVERYTHING}, lambda: 1000.0)


def digest(token: str = TOKEN, t: int = 1000, end: int = 2000, rand: str = "r", level: str = "admin") -> Auth:
    """What roslibjs sends for rosauth."""
    mac = hashlib.sha512(f"{token}clientdest{rand}{t}{level}{end}".encode()).hexdigest()
    return Auth("", mac, "client", "dest", rand, t, level, end)


def test_a_name_is_allowed_by_a_glob() -> None:
    BROWSER.topic("/camera/front/image")
    BROWSER.topic("/chat")
    BROWSER.service("/rapp_say")
    BROWSER.param("/limits/speed")
    BROWSER.service("/rosapi/topics")


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("topic", "/camera"),
        ("topic", "/chatter"),
        ("topic", "/Chat"),
        ("service", "/rapp_record"),
        ("offer", "/rosapi/topics"),
        ("param", "/run_id"),
    ],
)
def test_what_is_not_listed_is_refused(kind: str, name: str) -> None:
    with pytest.raises(Refused, match="browser may not"):
        getattr(BROWSER, kind)(name)


def test_a_token_tells_who_it_is(gate: Gate) -> None:
    assert gate.by_auth(Auth(TOKEN)) is BROWSER
    assert gate.by_auth(digest()) is BROWSER
    assert gate.by_auth(digest(OTHER)) is EVERYTHING
    assert not gate.is_open
    assert Gate().is_open


@pytest.mark.parametrize(
    "auth",
    [
        Auth(),
        Auth("a-long-secret-toke"),
        Auth(TOKEN + "x"),
        Auth("\udc80"),
        digest("wrong-long-secret-token"),
        digest(t=1000 - SKEW - 1),
        digest(t=1000 + SKEW + 1),
        digest(end=999),
        Auth("", digest().mac, "client", "dest", "r", 1000, "user", 2000),
        Auth("", digest().mac, "client", "dest", "r2", 1000, "admin", 2000),
    ],
)
def test_who_is_not_known_is_refused(gate: Gate, auth: Auth) -> None:
    with pytest.raises(Refused, match="cannot let you in"):
        gate.by_auth(auth)


def test_a_digest_is_good_once(gate: Gate) -> None:
    gate.by_auth(digest())
    with pytest.raises(Refused, match="used before"):
        gate.by_auth(digest())
    assert gate.by_auth(digest(rand="r2")) is BROWSER


def test_the_access_file() -> None:
    text = f'[clients.browser]\ntoken = "{TOKEN}"\ntopics = ["/camera/*"]\n[clients.all]\ntoken = "{OTHER}"\nservices = ["*"]\n'
    tokens = read_tokens(text)
    assert tokens[TOKEN] == Access("browser", ("/camera/*",), (), ())
    assert tokens[OTHER] == Access("all", (), ("*",), ())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[clients]",
        "clients = 3",
        "[clients.a]",
        "[clients.a",
        '[clients.a]\ntoken = "short"',
        f'[clients.a]\ntoken = "{TOKEN}"\ntopic = ["*"]',
        f'[clients.a]\ntoken = "{TOKEN}"\ntopics = "*"',
        f'[clients.a]\ntoken = "{TOKEN}"\ntopics = [1]',
        f'[clients.a]\ntoken = "{TOKEN}"\n[clients.b]\ntoken = "{TOKEN}"',
    ],
)
def test_an_access_file_that_is_off_lets_nobody_in(text: str) -> None:
    with pytest.raises(Invalid, match="cannot"):
        read_tokens(text)
