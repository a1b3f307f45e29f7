"""Views of the catalogue are made once for each state of the store."""

import json

from fakes.packages import manifest
from rapp_cloud.catalogue import RobotKind
from rapp_cloud.views import Views
from rapp_hop.hz.manifest import Manifest, parse_manifest

NAO, OTHER = RobotKind("nao", "1.0"), RobotKind("wheels", "1.0")


def rapp(name: str) -> Manifest:
    return parse_manifest(json.dumps(manifest(name)).encode())


class Store:
    """Manifests that somebody changes."""

    def __init__(self) -> None:
        self.there = (rapp("hello"),)

    def manifests(self) -> tuple[Manifest, ...]:
        return self.there


def test_a_view_is_made_once_and_anew_when_the_store_changes() -> None:
    store = Store()
    views = Views(store.manifests)
    first = views.described(NAO)
    assert [each["name"] for each in first] == ["hello"]
    assert views.described(NAO) is first
    assert views.commands(NAO, "en") is views.commands(NAO, "en")
    store.there = (*store.there, rapp("other"))
    assert [each["name"] for each in views.described(NAO)] == ["hello", "other"]
    assert sorted(views.commands(NAO, "en")) == ["hello", "other"]


def test_each_kind_of_robot_and_language_has_its_own() -> None:
    views = Views(Store().manifests)
    assert [each["compatible"] for each in views.described(NAO)] == [True]
    assert [each["compatible"] for each in views.described(OTHER)] == [False]
    assert views.commands(NAO, "en") == {"hello": ("say hello to me",)}
    assert views.commands(NAO, "pl") == views.commands(OTHER, "en") == {}
