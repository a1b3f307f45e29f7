"""package.json: what is right is read, what is wrong is refused by name (P24, P26 … P30)."""

import json
from typing import Any

import pytest

from fakes.packages import manifest
from rapp_hop.errors import Invalid
from rapp_hop.hz.manifest import CORE_SERVICES, Manifest, check_numbers, parse_manifest, reasons_against
from rapp_hop.hz.semver import parse_version, satisfies


def read(whole: Any) -> Manifest:
    return parse_manifest(json.dumps(whole).encode())


def test_a_right_one() -> None:
    found = read({**manifest(version="1.2.3", parameters={"seconds": 8}), "author": "somebody"})
    assert (found.name, found.version.text, found.agent, found.entry) == ("hello", "1.2.3", "dynamic", "agent.py")
    assert found.keywords == {"en": ("hello",)}
    assert found.sentences == {"en": ("say hello to me",)}
    assert found.permissions.core == ("rapp_say",)
    assert found.permissions.cloud == ("profile",)
    assert found.parameters == {"seconds": 8}


def test_a_dynamic_agent_may_be_javascript() -> None:
    assert read(manifest(runtime="javascript")).runtime == "javascript"


@pytest.mark.parametrize("parameters", [{"a": 2**63}, {"a": {"b": [1, [-(2**63) - 1]]}}])
def test_integers_of_more_than_64_bits_are_not_published(parameters: dict[str, Any]) -> None:
    with pytest.raises(Invalid, match="more than 64 bits"):
        check_numbers(read(manifest(parameters=parameters)))
    check_numbers(read(manifest(parameters={"a": [2**63 - 1, -(2**63), 1e300, True, None, "9" * 30]})))


def test_left_out_parts_grant_nothing() -> None:
    whole = manifest()
    whole["rapp"] = {"agent": "cloud", "entry": "a.py", "runtime": "python3"}
    found = read(whole)
    assert found.permissions.core == found.permissions.cloud == ()
    assert found.keywords == {}


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"", "cannot read JSON"),
        (b"[1]", "must be an object"),
        (b"\xff{}", "not UTF-8"),
        (b"[" * 100_000, "nested deeper"),
        (b'{"a":' * 50 + b"1" + b"}" * 50, "nested deeper"),
        (b'{"name":"a","name":"b"}', "'name' stands twice"),
        (b'{"x": NaN}', "NaN"),
        (b'{"x": 1e999}', "too large"),
        (b'{"x": "\\ud800"}', "lone surrogate"),
        (b'{"x": ' + b"9" * 10_000 + b"}", "cannot read JSON"),
        (b" " * 300_000, "at most 262144"),
    ],
)
def test_p24_not_json_we_take(data: bytes, match: str) -> None:
    with pytest.raises(Invalid, match=match):
        parse_manifest(data)


@pytest.mark.parametrize(
    "version",
    ["1.0 ", "01.0.0", "1.0", "1.0.0\n", "-1.0.0", "1.0.0+b", "1.0." + "9" * 40, "1.0.0-", "1.0.0-01", "", "١.0.0", "v1.0.0"],
)
def test_p26_versions(version: str) -> None:
    with pytest.raises(Invalid, match="cannot use version"):
        read(manifest(version=version))


def test_versions_in_order() -> None:
    order = [
        "0.9.9",
        "1.0.0-1",
        "1.0.0-2",
        "1.0.0-10",
        "1.0.0-alpha",
        "1.0.0-alpha.1",
        "1.0.0-rc.1",
        "1.0.0",
        "1.0.1",
        "1.2.0",
        "1.10.0",
        "2.0.0",
    ]
    versions = [parse_version(text) for text in order]
    assert sorted(versions[::2] + versions[1::2]) == versions


@pytest.mark.parametrize("name", ["", "Hello", "../x", "a-b", "a b", "9a", "a" * 65, "hello\n", "héllo", "hel\u202elo"])
def test_p16_names(name: str) -> None:
    with pytest.raises(Invalid, match="cannot use the name"):
        read(manifest(name=name))


@pytest.mark.parametrize("entry", ["", "../agent.py", "/bin/sh", "a/../../x", "./agent.py", "a//b", "a\\b"])
def test_p27_entries(entry: str) -> None:
    with pytest.raises(Invalid, match="cannot use the entry"):
        read(manifest(entry=entry))


@pytest.mark.parametrize("core", [["*"], ["rapp_everything"], ["/core_agent/rapp_say"], ["rapp_say*"]])
def test_p28_permissions(core: list[str]) -> None:
    with pytest.raises(Invalid, match="no such service"):
        read(manifest(permissions={"core": core}))
    with pytest.raises(Invalid, match="no wildcards"):
        read(manifest(permissions={"cloud": ["*"]}))


def test_all_core_services_can_be_granted() -> None:
    found = read(manifest(permissions={"core": sorted(CORE_SERVICES)}))
    assert len(found.permissions.core) == 22


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"agent": "static"}, "rapp.agent"),
        ({"runtime": "cobol"}, "rapp.runtime"),
        (
            {"agent": "cloud", "runtime": "javascript", "keywords": {}, "sentences": {}, "permissions": {}},
            "cloud agent: write python3",
        ),
        ({"entry": 3}, "rapp.entry must be a text"),
        ({"keywords": {"en": "hello"}}, "list of texts"),
        ({"keywords": {"en": [3]}}, "list of texts"),
        ({"keywords": {"english": ["x"]}}, "language 'english'"),
        ({"keywords": {"en": ["x", "x"]}}, "twice"),
        ({"keywords": {"en": ["a\nb"]}}, "control"),
        ({"keywords": {"en": [" "]}}, "1 to 64"),
        ({"sentences": {"en": ["x" * 201]}}, "1 to 200"),
        ({"sentences": {"en": [str(n) for n in range(65)]}}, "more than 64"),
        ({"permission": {}}, "rapp.permission in package.json"),
        ({"permissions": {"kore": []}}, "rapp.permissions.kore"),
        ({"permissions": []}, "must be an object"),
        ({"partner": "No Name"}, "cannot use the name"),
        ({"needs": {"api": "1.0"}}, "cannot read the condition"),
        ({"needs": {"api": 1}}, "must be a text"),
    ],
)
def test_wrong_parts_are_named(change: dict[str, Any], match: str) -> None:
    with pytest.raises(Invalid, match=match):
        read(manifest(**change))


@pytest.mark.parametrize("key", ["name", "version", "description", "rapp"])
def test_missing_parts_are_named(key: str) -> None:
    whole = manifest()
    del whole[key]
    with pytest.raises(Invalid, match=key):
        read(whole)


def test_p30_reasons_against_a_robot() -> None:
    found = read(manifest(needs={"robot": ["nao", "pepper"], "api": ">=1.1, <2.0"}))
    assert reasons_against(found, "nao", "1.1") == []
    assert reasons_against(found, "turtle", "2.0") == [
        "it needs a robot of kind nao or pepper, this is turtle",
        "it needs API >=1.1, <2.0, this robot has 2.0",
    ]


def test_conditions() -> None:
    assert satisfies("1.10", ">1.9")
    assert satisfies("1.0", "==1.0")
    assert not satisfies("1.0", ">1.0")
    assert not satisfies("0.9", ">=1.0, <2.0")
    with pytest.raises(Invalid, match="API version"):
        satisfies("one", ">=1.0")


def cloud(**change: Any) -> dict[str, Any]:
    return manifest(
        "hello_cloud", **{"agent": "cloud", "keywords": {}, "sentences": {}, "permissions": {"cloud": ["profile"]}, **change}
    )


def test_a_cloud_agent_has_no_voice_and_no_robot() -> None:
    assert read(cloud()).permissions.cloud == ("profile",)
    for change in ({"keywords": {"en": ["x"]}}, {"sentences": {"en": ["x"]}}, {"permissions": {"core": ["rapp_say"]}}):
        with pytest.raises(Invalid, match="a cloud agent has no"):
            read(cloud(**change))


def test_a_package_is_not_its_own_partner() -> None:
    assert read(manifest(partner="hello_cloud")).partner == "hello_cloud"
    with pytest.raises(Invalid, match="must name another package"):
        read(manifest(partner="hello"))
