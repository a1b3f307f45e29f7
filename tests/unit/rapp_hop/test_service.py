"""Parameters are checked before the function runs."""

from pathlib import Path
from typing import Any

import pytest

from rapp_hop.errors import Invalid, Refused
from rapp_hop.parameters import texts_to_values
from rapp_hop.registry import ServiceRegistry
from rapp_hop.service import Request, Service, service

REQUEST = Request("nao", "x", {}, "127.0.0.1")


@service
def mix(text: str, count: int = 3, ratio: float = 0.5, on: bool = False, names: list[str] | None = None) -> str:
    """Mix things.

    More text.
    """
    return f"{text} {count} {ratio} {on} {names}"


@service(name="upload", timeout=5, max_body=10)
async def other(request: Request, recording: Path, extra: dict[str, int] | None = None) -> str:
    return request.caller + recording.name


def bind(item: Service, arguments: dict[str, Any], files: dict[str, Path] | None = None) -> dict[str, Any]:
    return item.bind(arguments, files or {}, REQUEST)


def test_defaults_and_types() -> None:
    assert mix.function(**bind(mix, {"text": "a"})) == "a 3 0.5 False None"
    assert bind(mix, {"text": "a", "ratio": 2, "names": ["x"]}) == {"text": "a", "ratio": 2.0, "names": ["x"]}


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({}, "parameter text is missing"),
        ({"text": 1}, "text must be a text"),
        ({"text": None}, "text must be a text"),
        ({"text": "a", "count": "3"}, "count must be a whole number"),
        ({"text": "a", "count": True}, "count must be a whole number"),
        ({"text": "a", "count": 1.5}, "count must be a whole number"),
        ({"text": "a", "ratio": "x"}, "ratio must be a number"),
        ({"text": "a", "ratio": float("nan")}, "ratio must be a finite number"),
        ({"text": "a", "ratio": float("-inf")}, "ratio must be a finite number"),
        ({"text": "a", "on": 1}, "on must be true or false"),
        ({"text": "a", "names": ["x", 3]}, "names must be a list, each a text or null"),
        ({"text": "a", "more": 1}, "no parameter 'more'"),
        ({"text": "a", "self": 1}, "no parameter 'self'"),
    ],
)
def test_wrong_arguments_are_named(arguments: dict[str, Any], match: str) -> None:
    with pytest.raises(Invalid, match=match):
        bind(mix, arguments)


@pytest.mark.parametrize("texts", [{"ratio": "nan"}, {"ratio": "1e400"}, {"ratio": "-inf"}, {"ratio": "1_0.5"}, {"count": "1_0"}])
def test_h12_texts_that_are_no_numbers_but_for_python(texts: dict[str, str]) -> None:
    with pytest.raises(Invalid):
        bind(mix, texts_to_values({"text": "a", **texts}, mix.known))


def test_files_and_request_come_from_the_server_only() -> None:
    assert bind(other, {}, {"recording": Path("/tmp/a.ogg")})["request"] is REQUEST
    for arguments, files in [
        ({"recording": "/etc/passwd"}, {}),
        ({"recording": None}, {}),
        ({"request": {"caller": "x"}}, {"recording": Path("a")}),
        ({}, {"recording": Path("a"), "extra": Path("b")}),
        ({}, {}),
    ]:
        with pytest.raises(Invalid):
            bind(other, arguments, files)


def test_describe() -> None:
    assert other.describe()["url"] == "/hop/upload"
    assert mix.describe() == {
        "name": "mix",
        "url": "/hop/mix",
        "description": "Mix things.",
        "timeout": 30.0,
        "parameters": [
            {"name": "text", "type": "a text", "required": True},
            {"name": "count", "type": "a whole number", "required": False},
            {"name": "ratio", "type": "a number", "required": False},
            {"name": "on", "type": "true or false", "required": False},
            {"name": "names", "type": "a list, each a text or null", "required": False},
        ],
    }


def test_registry() -> None:
    registry = ServiceRegistry([mix])
    assert [item.name for item in registry] == ["available_services", "mix", "openapi"]
    with pytest.raises(ValueError, match="taken"):
        registry.add(mix)
    with pytest.raises(Refused) as caught:
        registry.get("nix")
    assert caught.value.status == 404


def test_functions_that_cannot_be_checked_are_refused_at_once() -> None:
    def bare(a) -> None: ...  # type: ignore[no-untyped-def]

    def strange(a: set[int]) -> None: ...

    def many(*a: int) -> None: ...

    for function in (bare, strange, many):
        with pytest.raises(TypeError):
            service(function)
