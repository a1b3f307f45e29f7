"""What a RApp's programs use of rapp_api, read from their text, against what its package.json asks for.

A hint for authors, not a wall: the core agent refuses what was not granted, however it is called.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from rapp_hop.hz.manifest import CORE_SERVICES, Manifest

_FUNCTIONS = {
    "text_to_speech": "rapp_say",
    "word_spotting": "rapp_recognize",
    "capture_audio": "rapp_record",
    "capture_audio_until_silence": "rapp_record_until_silence",
    "play_audio": "rapp_play_audio",
    "keep": "rapp_keep",
    **{
        name: f"rapp_{name}"
        for name in (
            *("move_to", "move_vel", "move_stop", "move_joint", "take_predefined_posture", "look_at_point", "rest"),
            *("move_along_path", "set_global_pose", "get_robot_pose", "get_transform"),
            *("capture_image", "set_camera_param", "set_camera_params"),
        )
    },
}
_MODULES = ("communication", "navigation", "vision")
_CALLS = ("call", "call_wait")  # of rapp_api.cloud
_MAILS = ("send_mail", "send_mail_wait")
_JAVASCRIPT = (".js", ".mjs", ".cjs")
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_VERB = re.compile(r"\b(?:communication|navigation|vision|keepsakes)\s*\.\s*(\w+)\s*\(")
_SERVICE = re.compile(r"""["'`]/?(rapp_\w+)["'`]""")  # as other clients of rosbridge write it
_CLOUD_CALL = re.compile(r"""\bcloud\s*\.\s*call\s*\(\s*["'`](\w+)["'`]""")
_MAIL = re.compile(r"\bcloud\s*\.\s*sendMail\s*\(")


def missing_permissions(folder: Path, manifest: Manifest) -> list[str]:
    """Return the core and cloud services that the programs use by name and the manifest does not ask for."""
    if manifest.agent != "dynamic":
        return []
    granted = {*manifest.permissions.core, *(f"cloud {name}" for name in manifest.permissions.cloud)}
    used = {name for path in sorted(folder.rglob("*.py")) for name in _used(path)}
    own = [path for path in folder.rglob("*") if path.suffix in _JAVASCRIPT and "node_modules" not in path.parts]
    used |= {name for path in sorted(own) for name in _used_in_javascript(path)}
    return sorted(used - granted)


def _used_in_javascript(path: Path) -> Iterator[str]:
    text = _COMMENT.sub("", path.read_text(errors="replace"))
    verbs = {_camel_case(name): service for name, service in _FUNCTIONS.items()}
    yield from (verbs[name] for name in _VERB.findall(text) if name in verbs)
    yield from (name for name in _SERVICE.findall(text) if name in CORE_SERVICES)
    yield from (f"cloud {name}" for name in _CLOUD_CALL.findall(text))
    if _MAIL.search(text):
        yield "cloud send_mail"


def _camel_case(name: str) -> str:
    first, *others = name.split("_")
    return first + "".join(map(str.capitalize, others))


def _used(path: Path) -> Iterator[str]:
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):
        yield f"a program Python can read: {path.name}"
        return
    imported = {
        alias.asname or alias.name: alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "rapp_api"
        for alias in node.names
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield from _called(node, imported)


def _called(node: ast.Call, imported: dict[str, str]) -> Iterator[str]:
    function = node.func
    if isinstance(function, ast.Name):
        module, name = "", imported.get(function.id, "")
    elif isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
        module, name = imported.get(function.value.id, "none of ours"), function.attr
    else:
        return
    if module in ("", *_MODULES) and name:
        known = {**_FUNCTIONS, **{service: service for service in _FUNCTIONS.values()}}
        if name in known:
            yield known[name]
    if module == "cloud" and name in _MAILS:
        yield "cloud send_mail"
    if module == "cloud" and name in _CALLS and node.args:
        service = node.args[0].value if isinstance(node.args[0], ast.Constant) else None
        if isinstance(service, str):
            yield f"cloud {service}"
