"""What a RApp must be to stand beside the others: newer, and asked for in words of its own."""

import json
from typing import Any

import pytest

from fakes.packages import manifest
from rapp_cloud.publishing import check_publication, collisions
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.manifest import Manifest, parse_manifest

CLOUD: dict[str, Any] = {"agent": "cloud", "keywords": {}, "sentences": {}, "permissions": {"core": [], "cloud": []}}


def rapp(name: str, version: str = "1.0.0", keyword: str = "", sentence: str = "", language: str = "en", **more: Any) -> Manifest:
    words = {"keywords": {language: [keyword or name]}, "sentences": {language: [sentence or f"start {name}"]}, **more}
    return parse_manifest(json.dumps(manifest(name, version, **words)).encode())


def test_words_of_its_own() -> None:
    others = [rapp("clock", keyword="time", sentence="what time is it?"), rapp("parrot")]
    check_publication(rapp("mail"), others)
    assert collisions(rapp("mail", keyword="e-mail"), [rapp("post", keyword="letter")]) == []


@pytest.mark.parametrize(
    "words",
    [
        {"keyword": "time"},
        {"keyword": "Time!"},
        {"keyword": "ｔｉｍｅ"},
        {"sentence": "What time  is it"},
        {"keyword": "what time is it"},
        {"sentence": "time"},
    ],
)
def test_words_that_another_has(words: dict[str, str]) -> None:
    with pytest.raises(Refused, match=r"is what one says for clock; choose other words"):
        check_publication(rapp("mail", **words), [rapp("clock", keyword="time", sentence="what time is it?")])


@pytest.mark.parametrize("words", [{"keyword": "Stop!"}, {"sentence": "stop"}, {"keyword": "arrête", "language": "fr"}])
def test_words_that_the_robot_keeps_for_itself(words: dict[str, str]) -> None:
    with pytest.raises(Refused, match=r"is what one says to stop the robot; choose other words"):
        check_publication(rapp("mail", **words), [])
    check_publication(rapp("mail", keyword="stop the music"), [])


def test_other_languages_old_versions_and_its_own_words_do_not_count() -> None:
    clock = rapp("clock", keyword="time")
    check_publication(rapp("mail", keyword="time", language="de"), [clock])
    check_publication(rapp("mail", keyword="time"), [clock, rapp("clock", "2.0.0", keyword="hour")])
    check_publication(rapp("clock", "1.0.1", keyword="time"), [clock])


@pytest.mark.parametrize("version", ["1.0.0", "0.9.0", "1.2.0-rc.1", "1.2.0"])
def test_versions_go_up(version: str) -> None:
    with pytest.raises(Refused, match=r"1\.2\.0 is on offer, raise its version"):
        check_publication(rapp("clock", version), [rapp("clock"), rapp("clock", "1.2.0")])


def test_somebody_must_be_able_to_ask_for_it() -> None:
    with pytest.raises(Invalid, match="nobody could ask for it"):
        check_publication(rapp("clock", keywords={}, sentences={"en": []}), [])
    check_publication(rapp("clock_cloud", **CLOUD), [])


def test_p29_dynamic_and_cloud_agent_of_one_version() -> None:
    clock = rapp("clock", "2.0.0", partner="clock_cloud")
    for there in ([], [rapp("clock_cloud", "1.0.0", **CLOUD)], [rapp("clock_cloud", "2.0.0")]):
        with pytest.raises(Refused, match=r"publish its cloud agent clock_cloud 2\.0\.0 first"):
            check_publication(clock, there)
    check_publication(clock, [rapp("clock_cloud", "2.0.0", **CLOUD)])
