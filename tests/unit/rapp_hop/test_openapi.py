"""The document that describes the services, checked by the specification's own validator."""

from pathlib import Path
from typing import Any, Literal

from openapi_spec_validator import OpenAPIV31SpecValidator

from rapp_hop.openapi import document
from rapp_hop.registry import ServiceRegistry
from rapp_hop.service import Request, service


@service(path="/hop/a/b/mix", timeout=5, max_body=1000)
def mix(
    request: Request,
    text: str,
    any_: Any,
    count: int = 3,
    ratio: float | None = None,
    on: bool = False,
    names: list[str] | None = None,
    table: dict[str, list[int]] | None = None,
    side: Literal["left", "right"] = "left",
) -> str:
    """Mix things.

    More text.
    """
    return ""


@service
def look(picture: Path, other: Path | None = None, language: str = "en") -> None: ...


def test_it_is_an_openapi_31_document() -> None:
    found = document(ServiceRegistry([mix, look]))
    OpenAPIV31SpecValidator(found).validate()
    assert found["openapi"].startswith("3.1.")
    assert sorted(found["paths"]) == ["/hop/a/b/mix", "/hop/available_services", "/hop/look", "/hop/openapi"]


def test_parameters_and_files() -> None:
    paths = document([mix, look])["paths"]
    plain = paths["/hop/a/b/mix"]["post"]["requestBody"]["content"]["application/json"]["schema"]
    assert plain["required"] == ["text", "any_"]
    assert plain["additionalProperties"] is False
    assert plain["properties"]["count"] == {"type": "integer", "default": 3}
    assert plain["properties"]["ratio"] == {"anyOf": [{"type": "number"}, {"type": "null"}], "default": None}
    assert plain["properties"]["names"]["anyOf"][0] == {"type": "array", "items": {"type": "string"}}
    assert plain["properties"]["side"] == {"enum": ["left", "right"], "default": "left"}
    assert plain["properties"]["any_"] == {} and "request" not in plain["properties"]
    form = paths["/hop/look"]["post"]["requestBody"]["content"]["multipart/form-data"]["schema"]
    assert form["required"] == ["picture"] and set(form["properties"]) == {"json", "picture", "other"}
    assert paths["/hop/a/b/mix"]["post"]["summary"] == "Mix things."
