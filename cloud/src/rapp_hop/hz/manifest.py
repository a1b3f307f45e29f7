"""The manifest of a RApp package: `package.json` as a typed, checked value. Pure.

Format of DESIGN §3.4. Keys outside the object `rapp` that we do not know (homepage, license …) are left alone; inside
it they are refused, for there a misspelt key would silently take a permission or a need away.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any, Literal, cast

from rapp_hop import strict_json
from rapp_hop.errors import Invalid
from rapp_hop.hz.semver import Version, check_condition, parse_version, satisfies
from rapp_hop.hz.text import NAME, check_language, check_name, check_text

MAX_BYTES = 256 * 1024  # of package.json
MAX_DEPTH = 6  # containers inside containers
MAX_DESCRIPTION = 1000  # characters
MAX_AUTHOR = 100  # characters
MAX_WORD = 64  # characters of a keyword
MAX_SENTENCE = 200  # characters
MAX_LANGUAGES = 32
MAX_PER_LANGUAGE = 64  # keywords or sentences
MAX_INTEGER = 2**63 - 1  # what readers of JSON in all languages hold
RUNTIMES = ("python3", "javascript")  # of dynamic agents; cloud agents are Python
_RAPP_KEYS = {"agent", "entry", "runtime", "keywords", "sentences", "permissions", "partner", "needs", "parameters"}

# The core agent's services, deliverable §4.5 in the names of DESIGN §3.1, and `keep`: what a RApp may ask to use.
CORE_SERVICES = frozenset(
    f"rapp_{name}"
    for name in (
        *("say", "recognize", "record", "record_until_silence", "play_audio", "cloud_call", "send_mail", "keep"),
        *("move_to", "move_vel", "move_stop", "move_joint", "take_predefined_posture", "look_at_point", "rest"),
        *("move_along_path", "set_global_pose", "get_robot_pose", "get_transform"),
        *("capture_image", "set_camera_param", "set_camera_params"),
    )
)

# The core agent's own words (`rapp_core.control.words`), by language: no RApp ever hears them, so none can be asked for by them.
STOP = {
    "en": "stop", "pl": "stop", "fr": "arrête", "de": "stopp", "es": "para", "it": "basta", "el": "σταμάτα", "pt": "para",
    "nl": "stop", "sv": "stopp", "da": "stop", "fi": "seis", "cs": "stop", "ru": "стой", "tr": "dur",
}  # fmt: skip


@dataclass(frozen=True)
class Permissions:
    """What a RApp may use: services of the core agent, and services in the cloud, by name."""

    core: tuple[str, ...] = ()
    cloud: tuple[str, ...] = ()


@dataclass(frozen=True)
class Needs:
    """What a RApp needs: kinds of robot (empty: any) and a condition on the core agent's API version."""

    robot: tuple[str, ...] = ()
    api: str = ">=1.0"


@dataclass(frozen=True)
class Manifest:
    """A checked `package.json`."""

    name: str
    version: Version
    description: str
    agent: Literal["dynamic", "cloud"]
    entry: str  # path of the program in the package, with /
    runtime: str
    keywords: Mapping[str, tuple[str, ...]]  # by language
    sentences: Mapping[str, tuple[str, ...]]  # by language
    permissions: Permissions
    partner: str | None  # the other package of a four-agent RApp
    needs: Needs
    parameters: Mapping[str, Any]  # handed to the program at its start; any JSON
    author: str = ""  # who made it, as they say; who signed for it is another matter


def parse_manifest(data: bytes) -> Manifest:
    """Return the manifest that `data`, the bytes of a package.json, spells.

    :raises Invalid: naming the first thing that is wrong
    """
    whole = strict_json.loads(data, limit=MAX_BYTES, depth=MAX_DEPTH)
    if not isinstance(whole, dict):
        raise Invalid("cannot read package.json: it must be an object")
    rapp = _object(whole, "rapp", "package.json", required=True)
    _only(rapp, _RAPP_KEYS, "rapp")
    agent = _text(rapp, "agent", "rapp")
    if agent not in ("dynamic", "cloud"):
        raise Invalid(f"cannot use rapp.agent {agent[:40]!r}: write dynamic or cloud")
    runtime = _text(rapp, "runtime", "rapp")
    if runtime not in RUNTIMES:
        raise Invalid(f"cannot use rapp.runtime {runtime[:40]!r}: known are {', '.join(RUNTIMES)}")
    partner = rapp.get("partner")
    manifest = Manifest(
        name=check_name(_text(whole, "name", "package.json")),
        version=parse_version(_text(whole, "version", "package.json")),
        description=check_text(_text(whole, "description", "package.json"), MAX_DESCRIPTION, "description"),
        agent=cast('Literal["dynamic", "cloud"]', agent),
        entry=_entry(_text(rapp, "entry", "rapp")),
        runtime=runtime,
        keywords=_phrases(rapp, "keywords", MAX_WORD),
        sentences=_phrases(rapp, "sentences", MAX_SENTENCE),
        permissions=_permissions(_object(rapp, "permissions", "rapp")),
        partner=None if partner is None else check_name(_text(rapp, "partner", "rapp")),
        needs=_needs(_object(rapp, "needs", "rapp")),
        parameters=_object(rapp, "parameters", "rapp"),
        author=_author(whole.get("author", "")),
    )
    _check_kind(manifest)
    return manifest


def check_numbers(manifest: Manifest) -> None:
    """Check what a package must keep to from now on; one that is on offer already, and does not, is still read.

    :raises Invalid: an integer in its parameters has more than 64 bits
    """
    waiting: list[Any] = [manifest.parameters]
    while waiting:
        item = waiting.pop()
        if isinstance(item, Mapping):
            waiting.extend(item.values())
        elif isinstance(item, list):
            waiting.extend(item)
        elif isinstance(item, int) and not -MAX_INTEGER - 1 <= item <= MAX_INTEGER:
            raise Invalid("cannot use rapp.parameters in package.json: an integer has more than 64 bits, write it as a text")


def _check_kind(manifest: Manifest) -> None:
    """A cloud agent is started for its dynamic agent: nobody asks for it by voice, and it has no core agent."""
    if manifest.partner == manifest.name:
        raise Invalid("cannot use rapp.partner in package.json: it must name another package, such as NAME_cloud")
    if manifest.agent == "cloud" and (manifest.keywords or manifest.sentences or manifest.permissions.core):
        raise Invalid("cannot read package.json: a cloud agent has no keywords, no sentences and no permissions.core")
    if manifest.agent == "cloud" and manifest.runtime != "python3":
        raise Invalid(f"cannot use rapp.runtime {manifest.runtime!r} of a cloud agent: write python3")


def reasons_against(manifest: Manifest, kind: str, api: str) -> list[str]:
    """Return why a robot of this kind and API version cannot run the RApp; empty when it can (P30).

    :raises Invalid: when `api` is not MAJOR.MINOR
    """
    reasons = []
    if manifest.needs.robot and kind not in manifest.needs.robot:
        reasons.append(f"it needs a robot of kind {' or '.join(manifest.needs.robot)}, this is {kind}")
    if not satisfies(api, manifest.needs.api):
        reasons.append(f"it needs API {manifest.needs.api}, this robot has {api}")
    return reasons


def _author(value: Any) -> str:
    """An author as npm and Hop write it: a text, or an object with a name."""
    name = value.get("name", "") if isinstance(value, dict) else value
    if not isinstance(name, str):
        raise Invalid("cannot read package.json: author must be a text")
    return check_text(name, MAX_AUTHOR, "author") if name else ""


def _only(found: Mapping[str, Any], known: set[str], where: str) -> None:
    strange = sorted(set(found) - known)
    if strange:
        raise Invalid(f"cannot use {where}.{strange[0][:40]} in package.json: known are {', '.join(sorted(known))}")


def _object(parent: Mapping[str, Any], key: str, where: str, *, required: bool = False) -> dict[str, Any]:
    value = parent.get(key, None if required else {})
    if not isinstance(value, dict):
        raise Invalid(f"cannot read package.json: {where}.{key} must be an object")
    return value


def _text(parent: Mapping[str, Any], key: str, where: str) -> str:
    value = parent.get(key)
    if not isinstance(value, str):
        raise Invalid(f"cannot read package.json: {where}.{key} must be a text")
    return value


def _texts(parent: Mapping[str, Any], key: str, where: str) -> tuple[str, ...]:
    value = parent.get(key, [])
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise Invalid(f"cannot read package.json: {where}.{key} must be a list of texts")
    if len(value) > MAX_PER_LANGUAGE:
        raise Invalid(f"cannot read package.json: {where}.{key} has more than {MAX_PER_LANGUAGE} entries")
    if len(set(value)) != len(value):
        raise Invalid(f"cannot read package.json: {where}.{key} says something twice")
    return tuple(value)


def _phrases(rapp: Mapping[str, Any], key: str, limit: int) -> Mapping[str, tuple[str, ...]]:
    languages = _object(rapp, key, "rapp")
    if len(languages) > MAX_LANGUAGES:
        raise Invalid(f"cannot read package.json: rapp.{key} has more than {MAX_LANGUAGES} languages")
    where = f"rapp.{key}"
    for language in languages:
        check_language(language, where)
    return {
        language: tuple(check_text(item, limit, f"{where}.{language}") for item in _texts(languages, language, where))
        for language in languages
    }


def _entry(text: str) -> str:
    path = PurePosixPath(text)
    if not text or str(path) != text or path.is_absolute() or ".." in path.parts or "\\" in text:
        raise Invalid(f"cannot use the entry {text[:80]!r}: write a path inside the package such as agent.py")
    return text


def _permissions(found: Mapping[str, Any]) -> Permissions:
    _only(found, {"core", "cloud"}, "rapp.permissions")
    core = _texts(found, "core", "rapp.permissions")
    cloud = _texts(found, "cloud", "rapp.permissions")
    _known(core, CORE_SERVICES)
    for name in cloud:
        if not NAME.fullmatch(name):
            raise Invalid(f"cannot grant {name[:70]!r}: name each cloud service, there are no wildcards")
    return Permissions(core, cloud)


def _known(names: Iterable[str], services: frozenset[str]) -> None:
    for name in names:
        if name not in services:
            raise Invalid(f"cannot grant {name[:70]!r}: the core agent has no such service")


def _needs(found: Mapping[str, Any]) -> Needs:
    _only(found, {"robot", "api"}, "rapp.needs")
    robots = tuple(check_name(kind) for kind in _texts(found, "robot", "rapp.needs"))
    api = found.get("api", Needs.api)
    if not isinstance(api, str):
        raise Invalid("cannot read package.json: rapp.needs.api must be a text such as >=1.0")
    check_condition(api)
    return Needs(robots, api)
