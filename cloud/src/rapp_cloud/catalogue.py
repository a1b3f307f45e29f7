"""The catalogue: what the shelf holds, seen by one robot. Pure."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from rapp_hop.errors import Refused
from rapp_hop.hz.manifest import Manifest, reasons_against


@dataclass(frozen=True)
class RobotKind:
    """What a robot is, as far as a RApp can need it."""

    kind: str  # such as nao
    api_version: str  # of its core agent, MAJOR.MINOR


@dataclass(frozen=True)
class Entry:
    """One RApp for one robot; compatible when there are no reasons against it."""

    manifest: Manifest
    reasons: tuple[str, ...]

    @property
    def compatible(self) -> bool:
        """Whether the robot can run it."""
        return not self.reasons

    def describe(self) -> dict[str, Any]:
        """Return the entry as `list_rapps` gives it."""
        return {
            "name": self.manifest.name,
            "version": self.manifest.version.text,
            "description": self.manifest.description,
            "keywords": {language: list(words) for language, words in self.manifest.keywords.items()},
            "sentences": {language: list(texts) for language, texts in self.manifest.sentences.items()},
            "compatible": self.compatible,
            "reasons": list(self.reasons),
        }


def catalogue(manifests: Iterable[Manifest], robot: RobotKind) -> list[Entry]:
    """Return the newest version of each RApp that starts on a robot, sorted by name; releases go before pre-releases.

    Packages of cloud agents are no RApps of their own and are left out; without its own, a four-agent RApp cannot run.
    """
    manifests = list(manifests)
    cloud = {(manifest.name, manifest.version.text) for manifest in manifests if manifest.agent == "cloud"}
    newest: dict[str, Manifest] = {}
    for manifest in manifests:
        if manifest.agent == "dynamic" and _rank(manifest) > _rank(newest.get(manifest.name)):
            newest[manifest.name] = manifest
    found = (newest[name] for name in sorted(newest))
    return [Entry(each, tuple(reasons_against(each, robot.kind, robot.api_version) + _alone(each, cloud))) for each in found]


def cloud_agent_of(manifests: Iterable[Manifest], rapp: str, version: str) -> Manifest:
    """Return the manifest of the cloud agent of a RApp in that version; both packages carry the same one (P29).

    :raises Refused: there is none
    """
    there = {(manifest.name, manifest.version.text): manifest for manifest in manifests}
    own = there.get((rapp, version))
    if own is None or own.agent != "dynamic":
        raise Refused(f"cannot start a cloud agent for {rapp[:70]} {version[:70]}: the store has no such RApp")
    if own.partner is None:
        raise Refused(f"cannot start a cloud agent for {rapp}: its package.json names no partner")
    found = there.get((own.partner, version))
    if found is None or found.agent != "cloud":
        raise Refused(f"cannot start a cloud agent for {rapp}: {_alone(own, set())[0]}")
    if found.partner not in (None, rapp):
        raise Refused(f"cannot start {found.name} for {rapp}: its package.json says it is the partner of {found.partner}")
    return found


def _alone(manifest: Manifest, cloud: set[tuple[str, str]]) -> list[str]:
    if manifest.partner is None or (manifest.partner, manifest.version.text) in cloud:
        return []
    return [f"its cloud agent {manifest.partner} {manifest.version.text} is not in the store"]


def commands(entries: Iterable[Entry], language: str) -> dict[str, tuple[str, ...]]:
    """Return the sentences in a language of each RApp that the robot can run and that has some."""
    return {
        entry.manifest.name: entry.manifest.sentences[language]
        for entry in entries
        if entry.compatible and entry.manifest.sentences.get(language)
    }


def _rank(manifest: Manifest | None) -> tuple[Any, ...]:
    return () if manifest is None else ("-" not in manifest.version.text, manifest.version.key)
