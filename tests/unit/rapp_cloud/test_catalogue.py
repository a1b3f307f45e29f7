"""The catalogue as one robot sees it."""

import json
from typing import Any

import pytest

from fakes.packages import manifest
from rapp_cloud.catalogue import RobotKind, catalogue, cloud_agent_of, commands
from rapp_hop.errors import Refused
from rapp_hop.hz.manifest import Manifest, parse_manifest

NAO = RobotKind("nao", "1.0")


def rapp(name: str = "hello", version: str = "1.0.0", **fields: Any) -> Manifest:
    return parse_manifest(json.dumps(manifest(name, version, **fields)).encode())


def test_describes_name_words_and_sentences() -> None:
    assert [entry.describe() for entry in catalogue([rapp()], NAO)] == [
        {
            "name": "hello",
            "version": "1.0.0",
            "description": "Says hello",
            "keywords": {"en": ["hello"]},
            "sentences": {"en": ["say hello to me"]},
            "compatible": True,
            "reasons": [],
        }
    ]


def test_newest_release_of_each_sorted_by_name() -> None:
    shelf = [rapp("zoo"), rapp(version="1.9.0"), rapp(version="1.10.0"), rapp(version="2.0.0-rc.1"), rapp(version="1.2.0")]
    assert [(entry.manifest.name, entry.manifest.version.text) for entry in catalogue(shelf, NAO)] == [
        ("hello", "1.10.0"),
        ("zoo", "1.0.0"),
    ]


def test_a_pre_release_when_there_is_nothing_else() -> None:
    assert [entry.manifest.version.text for entry in catalogue([rapp(version="1.0.0-rc.1")], NAO)] == ["1.0.0-rc.1"]


def test_reasons_against() -> None:
    entry = catalogue([rapp()], RobotKind("turtle", "0.9"))[0]
    assert not entry.compatible
    assert len(entry.describe()["reasons"]) == 2


def cloud_agent(name: str = "hello_cloud", version: str = "1.0.0", **fields: Any) -> Manifest:
    return rapp(name, version, **{"agent": "cloud", "keywords": {}, "sentences": {}, "permissions": {}, **fields})


def test_cloud_agents_are_no_rapps_of_their_own() -> None:
    shelf = [rapp(partner="hello_cloud"), cloud_agent()]
    assert [entry.manifest.name for entry in catalogue(shelf, NAO)] == ["hello"]
    assert commands(catalogue(shelf, NAO), "en") == {"hello": ("say hello to me",)}


def test_p29_a_rapp_whose_cloud_agent_is_not_there_in_its_version_is_not_for_this_robot() -> None:
    for other in ([], [cloud_agent(version="1.0.1")], [rapp("hello_cloud")]):
        entry = catalogue([rapp(partner="hello_cloud"), *other], NAO)[0]
        assert entry.reasons == ("its cloud agent hello_cloud 1.0.0 is not in the store",)
    assert catalogue([rapp(partner="hello_cloud"), cloud_agent()], NAO)[0].compatible


def test_the_cloud_agent_of_a_rapp_is_found_by_name_and_version() -> None:
    shelf = [rapp(partner="hello_cloud"), cloud_agent(), cloud_agent(version="2.0.0"), rapp("alone")]
    assert cloud_agent_of(shelf, "hello", "1.0.0").name == "hello_cloud"
    for name, version, words in [
        ("hello", "2.0.0", "no such RApp"),
        ("nobody", "1.0.0", "no such RApp"),
        ("hello_cloud", "1.0.0", "no such RApp"),
        ("alone", "1.0.0", "names no partner"),
    ]:
        with pytest.raises(Refused, match=words):
            cloud_agent_of(shelf, name, version)
    with pytest.raises(Refused, match="not in the store"):
        cloud_agent_of([rapp(partner="hello_cloud")], "hello", "1.0.0")


def test_a_cloud_agent_serves_the_rapp_that_it_names() -> None:
    shelf = [rapp(partner="hello_cloud"), cloud_agent(partner="other")]
    with pytest.raises(Refused, match="partner of other"):
        cloud_agent_of(shelf, "hello", "1.0.0")


def test_commands_are_the_sentences_of_what_the_robot_can_run() -> None:
    shelf = [
        rapp(),
        rapp("other", needs={"robot": ["turtle"]}),
        rapp("mute", sentences={}),
        rapp("polski", sentences={"pl": ["cześć"]}),
    ]
    assert commands(catalogue(shelf, NAO), "en") == {"hello": ("say hello to me",)}
    assert commands(catalogue(shelf, NAO), "pl") == {"polski": ("cześć",)}
