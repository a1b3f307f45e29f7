"""Which form a request is written in: method, headers and query decide, never the body."""

import pytest

from rapp_hop.errors import Invalid, Refused
from rapp_hop.forms import HOP, ORIGINAL, OWN, form_of
from rapp_hop.protocol import Form

MULTIPART = "multipart/form-data; boundary=B"
FORM = "application/x-www-form-urlencoded"


@pytest.mark.parametrize(
    ("method", "headers", "query", "form"),
    [
        ("POST", {"content-type": "application/json"}, "", OWN),
        ("POST", {"content-type": "Application/JSON; charset=utf-8"}, "", OWN),
        ("POST", {"content-type": MULTIPART, "accept": "application/json"}, "", OWN),
        ("POST", {"content-type": MULTIPART, "accept": "*/*", "user-agent": "rapp-platform-api/python"}, "", ORIGINAL),
        ("POST", {"content-type": MULTIPART}, "", ORIGINAL),
        ("POST", {"content-type": FORM}, "", ORIGINAL),
        ("POST", {}, "", ORIGINAL),
        ("GET", {"user-agent": "rapp_api/cpp/0.6.0"}, "", ORIGINAL),
        ("GET", {}, "", HOP),
        ("GET", {"user-agent": "curl/8"}, "name=x", HOP),
        ("GET", {}, "hop-encoding=hop&vals=.", HOP),
        ("PUT", {"hop-serialize": "x-hop", "hop-client": "hop"}, "", HOP),
        ("PUT", {}, "", HOP),
        ("HEAD", {}, "", HOP),
        ("POST", {"content-type": MULTIPART, "hop-serialize": "x-hop"}, "", HOP),
        ("POST", {"content-type": MULTIPART, "hop-serialize": "x-hop", "accept": "application/json"}, "", HOP),
        ("POST", {"content-type": "application/json", "hop-serialize": "json"}, "", HOP),
        ("POST", {"hopjs-arguments": "hop-encoding=hopjs&vals=0."}, "", HOP),
        ("POST", {"hop-arguments": "[]", "hop-serialize": "json"}, "", HOP),
        ("POST", {"content-type": "application/json"}, "hop-encoding=json&vals=[]", HOP),
    ],
)
def test_each_client_is_told_by_its_head(method: str, headers: dict[str, str], query: str, form: Form) -> None:
    assert form_of(method, headers, query) is form


@pytest.mark.parametrize("kind", ["text/plain", "text/xml", "application/octet-stream", "multipart/mixed; boundary=B"])
def test_h11_what_is_in_no_form_is_invalid(kind: str) -> None:
    with pytest.raises(Invalid):
        form_of("POST", {"content-type": kind})


@pytest.mark.parametrize("method", ["DELETE", "PATCH", "OPTIONS", "TRACE", "get", "PROPFIND"])
def test_h11_other_methods_call_nothing(method: str) -> None:
    with pytest.raises(Refused) as caught:
        form_of(method, {"hop-serialize": "x-hop"})
    assert caught.value.status == 405
