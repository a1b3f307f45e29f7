"""What a RApp's programs use of rapp_api, read from their text, against what its package.json asks for.

A hint for authors, not a wall: the core agent refuses what was not granted, however it is called.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

from rapp_hop.hz.manifest import Manifest

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


def missing_permissions(folder: Path, manifest: Manifest) -> list[str]:
    """Return the core and cloud services that the programs use by name and the manifest does not ask for."""
    if manifest.agent != "dynamic":
        return []
    granted = {*manifest.permissions.core, *(f"cloud {name}" for name in manifest.permissions.cloud)}
    used = {name for path in sorted(folder.rglob("*.py")) for name in _used(path)}
    return sorted(used - granted)


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
