"""The OpenAPI 3.1 document of a server's services. Pure."""

from collections.abc import Iterable
from typing import Any

from rapp_hop.parameters import Parameter, schema
from rapp_hop.service import Service

_ERRORS = {
    "400": "The arguments are not as they must be",
    "401": "The token is missing or wrong",
    "403": "Refused",
    "404": "There is no such service",
    "408": "Out of time",
    "413": "Too many bytes",
    "429": "Too many calls",
    "500": "The platform has a fault of its own",
    "503": "Busy or away, try again later",
}
_ERROR_SCHEMA = {
    "type": "object",
    "required": ["error"],
    "properties": {
        "error": {
            "type": "object",
            "required": ["kind", "message"],
            "properties": {
                "kind": {"enum": ["refused", "unreachable", "invalid", "bug"]},
                "message": {"type": "string"},
            },
        }
    },
}


def document(services: Iterable[Service]) -> dict[str, Any]:
    """Return the document: one path for each service, in HOP's own JSON form."""
    return {
        "openapi": "3.1.0",
        "info": {"title": "HOP services", "version": "1.0.0", "summary": "Services bound to URLs, called with POST."},
        "paths": {item.path: {"post": _operation(item)} for item in services},
        "components": {
            "schemas": {"Error": _ERROR_SCHEMA},
            "responses": {status: _failure(text) for status, text in _ERRORS.items()},
            "securitySchemes": {"token": {"type": "apiKey", "in": "header", "name": "Accept-Token"}},
        },
        "security": [{"token": []}],
    }


def _operation(item: Service) -> dict[str, Any]:
    files = [parameter for parameter in item.parameters if parameter.takes_file]
    plain = _object([parameter for parameter in item.parameters if not parameter.takes_file])
    if files:
        form = {
            "type": "object",
            "properties": {"json": plain, **{file.name: {"type": "string", "format": "binary"} for file in files}},
        }
        needed = [file.name for file in files if file.required]
        content = {
            "multipart/form-data": {
                "schema": {**form, **({"required": needed} if needed else {})},
                "encoding": {"json": {"contentType": "application/json"}},
            }
        }
    else:
        content = {"application/json": {"schema": plain}}
    return {
        "operationId": item.name,
        "summary": item.description or item.name,
        "requestBody": {"required": bool(plain.get("required") or files), "content": content},
        "responses": {
            "200": {"description": "The result", "content": {"application/json": {"schema": {}}}},
            **{status: {"$ref": f"#/components/responses/{status}"} for status in _ERRORS},
        },
        "x-timeout": item.timeout,
        "x-max-body": item.max_body,
    }


def _object(parameters: list[Parameter]) -> dict[str, Any]:
    found: dict[str, Any] = {
        "type": "object",
        "properties": {parameter.name: _property(parameter) for parameter in parameters},
        "additionalProperties": False,
    }
    needed = [parameter.name for parameter in parameters if parameter.required]
    return {**found, "required": needed} if needed else found


def _property(parameter: Parameter) -> dict[str, Any]:
    found = schema(parameter.hint)
    if not parameter.required and _is_json(parameter.default):
        found = {**found, "default": parameter.default}
    return found


def _is_json(value: Any) -> bool:
    return value is None or isinstance(value, str | bool | int | float | list | dict)


def _failure(text: str) -> dict[str, Any]:
    return {"description": text, "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Error"}}}}
