"""What Hop's package manager is told: lists it can read, and the newest package that a pattern fits."""

import json

import pytest

from fakes.packages import manifest
from rapp_hop.hz.manifest import Manifest, parse_manifest
from rapp_hop.hz.weblet import resolve, synclist, weblet_info

URL = "http://127.0.0.1:9001/hop/weblets/download"


def package(name: str, version: str, description: str = "Says hello", author: object = "me") -> Manifest:
    whole = {**manifest(name, version), "description": description, "author": author}
    return parse_manifest(json.dumps(whole).encode())


PACKAGES = [package(*item) for item in [
    ("hello", "1.0.0"), ("hello", "1.2.9"), ("hello", "1.2.10"), ("hello", "2.0.0-rc.1"), ("hello", "10.0.0"), ("dep", "0.2.0"),
]]  # fmt: skip


def test_weblet_info() -> None:
    assert weblet_info(package("hello", "1.0.0", author={"name": "Żak"})).decode() == (
        '((name "hello") (version "1.0.0") (author "Żak") (category "other") (title "Says hello") (description "Says hello"))\n'
    )


def test_no_text_ends_its_string() -> None:
    text = weblet_info(package("hello", "1.0.0", 'a "quoted" \\ text")) (evil "x', author="")).decode()
    assert '(description "a \\"quoted\\" \\\\ text\\")) (evil \\"x")' in text
    assert '(author "unknown")' in text


def test_synclist_has_the_newest_release_of_each_name() -> None:
    lines = synclist(PACKAGES, URL).decode().splitlines()
    assert lines[0] == "(" and lines[-1] == ")"
    assert [line.split(") (")[0] for line in lines[1:-1]] == [
        f'((url "{URL}?weblet=dep-0.2.0.hz"', f'((url "{URL}?weblet=hello-10.0.0.hz"',
    ]  # fmt: skip
    assert synclist([], URL) == b"(\n)\n"


@pytest.mark.parametrize(
    ("pattern", "found"),
    [
        ("hello-*.hz", "hello-10.0.0.hz"),
        ("hello-1.*.hz", "hello-1.2.10.hz"),
        ("hello-1.2.*.hz", "hello-1.2.10.hz"),
        ("hello-3.*.hz", ""),
        ("hello-1.2.9.hz", "hello-1.2.9.hz"),
        ("hello-2.0.0-rc.1.hz", "hello-2.0.0-rc.1.hz"),
        ("nothing-*.hz", ""),
        ("../hello-*.hz", ""),
        ("*", ""),
        ("", ""),
    ],
)
def test_resolve(pattern: str, found: str) -> None:
    assert resolve(PACKAGES, pattern) == found
