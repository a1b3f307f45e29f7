"""Services by name, by path and for how long; what one caller may take; calls that run once; whose token it is."""

import asyncio
from pathlib import Path

import pytest

from rapp_hop.callers import token_of
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.fairness import Brake, Fairness
from rapp_hop.protocol import WireAnswer
from rapp_hop.registry import ServiceRegistry
from rapp_hop.repeats import CAPACITY, KEEP, Repeats
from rapp_hop.service import Service, check_path, service


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def make(**bounds: object) -> Service:
    def hello() -> None: ...

    return service(**bounds)(hello)  # type: ignore[call-overload,no-any-return]


def gone(registry: ServiceRegistry, path: str) -> bool:
    try:
        registry.at(path)
    except Refused as error:
        assert error.status == 404
        return True
    return False


def test_names_paths_and_a_slash_at_the_end() -> None:
    registry = ServiceRegistry([make(path="/hop/a/b")])
    assert registry.get("hello") is registry.at("/hop/a/b") is registry.at("/hop/a/b/")
    assert gone(registry, "/hop/hello")
    registry.move("hello", "/hop/other")
    assert gone(registry, "/hop/a/b") and registry.at("/hop/other").name == "hello"
    with pytest.raises(ValueError, match="taken"):
        registry.move("hello", "/hop/openapi")
    with pytest.raises(ValueError, match="taken"):
        registry.add(make(name="new", path="/hop/other"))


def test_unregister_and_register_again() -> None:
    registry = ServiceRegistry([make()])
    assert registry.remove("hello").name == "hello"
    assert gone(registry, "/hop/hello")
    with pytest.raises(Refused):
        registry.remove("hello")
    registry.add(make())
    assert not gone(registry, "/hop/hello")


def test_ttl_holds_for_calls_whose_heads_came_before() -> None:
    registry = ServiceRegistry([make(ttl=1), make(name="forever")])
    items = [registry.at("/hop/hello") for _ in range(2)]
    registry.spend(items[0])
    with pytest.raises(Refused) as caught:
        registry.spend(items[1])
    assert caught.value.status == 404
    registry.spend(registry.get("forever"))


def test_ttl_counts_calls() -> None:
    registry = ServiceRegistry([make(ttl=2)])
    registry.spend(registry.at("/hop/hello"))
    assert not gone(registry, "/hop/hello")
    registry.spend(registry.at("/hop/hello"))
    assert gone(registry, "/hop/hello")
    assert [item.name for item in registry] == ["available_services", "openapi"]


def test_a_lifetime_ends() -> None:
    clock = Clock()
    registry = ServiceRegistry([make(lifetime=10)], clock)
    clock.now = 9.9
    assert not gone(registry, "/hop/hello")
    clock.now = 10
    assert gone(registry, "/hop/hello")
    registry.add(make())


@pytest.mark.parametrize(
    "path", ["/hello", "/hop/", "/hop/../x", "/hop/a//b", "/hop/a b", "/hop/A", "/hop/-/x", "/hop/a/..", "hop/a"]
)
def test_paths_that_are_none(path: str) -> None:
    with pytest.raises(Invalid):
        check_path(path)


@pytest.mark.parametrize("bounds", [{"timeout": 0}, {"timeout": -1}, {"timeout": float("nan")}, {"ttl": 0}, {"lifetime": 0}])
def test_bounds_that_are_none(bounds: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="above zero"):
        make(**bounds)


def test_a_file_beside_the_source() -> None:
    assert make().resource("logo.png") == Path(__file__).resolve().parent / "logo.png"


def test_h15_each_caller_has_a_bucket_of_its_own() -> None:
    clock = Clock()
    fairness = Fairness(rate=2, burst=3, clock=clock)

    def admitted(caller: str) -> int:
        count = 0
        try:
            while count < 100:
                fairness.admit(caller)
                count += 1
        except Unreachable as error:
            assert error.status == 429
        return count

    assert (admitted("a"), admitted("a"), admitted("b")) == (3, 0, 3)
    clock.now = 1
    assert admitted("a") == 2
    clock.now = 1000
    assert admitted("a") == 3


def test_h08_so_many_lines_a_second() -> None:
    clock = Clock()
    brake = Brake(2, clock)
    assert [brake.allows() for _ in range(4)] == [True, True, False, False]
    clock.now = 1
    assert brake.allows() and brake.held_back == 2


def run_once(repeats: Repeats, ran: list[str], body: bytes = b"", key: str = "key-0001", caller: str = "a") -> str:
    async def run() -> WireAnswer:
        ran.append(key)
        return WireAnswer(200, "text/plain", f"answer {len(ran)}".encode())

    answer = asyncio.run(repeats.once(caller, "/hop/x", key, body, run))
    assert isinstance(answer.body, bytes)
    return answer.body.decode()


def test_h17_a_key_runs_once_for_its_time() -> None:
    clock, ran = Clock(), list[str]()
    repeats = Repeats(clock)
    assert [run_once(repeats, ran) for _ in range(3)] == ["answer 1"] * 3
    assert run_once(repeats, ran, caller="b") == "answer 2"
    with pytest.raises(Refused):
        run_once(repeats, ran, b"other arguments")
    clock.now = KEEP
    assert run_once(repeats, ran) == "answer 3"
    for number in range(CAPACITY):
        run_once(repeats, ran, key=f"key-{number:06}")
    assert run_once(repeats, ran) == f"answer {len(ran)}"  # the oldest is forgotten


def test_h17_what_was_turned_away_or_failed_may_run_again() -> None:
    repeats = Repeats(Clock())

    async def main() -> None:
        async def busy() -> WireAnswer:
            return WireAnswer(503, "text/plain", b"", (("Retry-After", "1"),))

        async def failing() -> WireAnswer:
            raise Invalid("cannot")

        async def good() -> WireAnswer:
            return WireAnswer(200, "text/plain", b"x" * 10**6)

        assert (await repeats.once("a", "/hop/x", "key-0001", b"", busy)).status == 503
        with pytest.raises(Invalid):
            await repeats.once("a", "/hop/x", "key-0001", b"", failing)
        assert (await repeats.once("a", "/hop/x", "key-0001", b"", good)).status == 200
        with pytest.raises(Refused, match="too long"):
            await repeats.once("a", "/hop/x", "key-0001", b"", good)

    asyncio.run(main())


@pytest.mark.parametrize(
    ("headers", "token"),
    [
        ({}, None),
        ({"accept-token": "x"}, "x"),
        ({"authorization": "Bearer x"}, "x"),
        ({"authorization": "Basic YTp4OnkK"}, "x:y\n"),
        ({"authorization": "Bearer x", "accept-token": "x"}, "x"),
        ({"authorization": "Basic ="}, None),
        ({"authorization": "Digest x"}, None),
    ],
)
def test_h14_tokens(headers: dict[str, str], token: str | None) -> None:
    assert token_of(headers) == token


def test_h14_two_tokens_that_differ() -> None:
    with pytest.raises(HopError):
        token_of({"authorization": "Bearer x", "accept-token": "y"})
