"""The catalogue as one robot sees it."""

import json
from typing import Any

from fakes.packages import manifest
from rapp_cloud.catalogue import RobotKind, catalogue, commands
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


def test_cloud_agents_are_no_rapps_of_their_own() -> None:
    assert catalogue([rapp(agent="cloud")], NAO) == []


def test_commands_are_the_sentences_of_what_the_robot_can_run() -> None:
    shelf = [
        rapp(),
        rapp("other", needs={"robot": ["turtle"]}),
        rapp("mute", sentences={}),
        rapp("polski", sentences={"pl": ["cześć"]}),
    ]
    assert commands(catalogue(shelf, NAO), "en") == {"hello": ("say hello to me",)}
    assert commands(catalogue(shelf, NAO), "pl") == {"polski": ("cześć",)}
