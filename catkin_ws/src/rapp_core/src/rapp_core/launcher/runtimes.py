"""What runs a RApp's entry, whether it is on this robot, and whether a spare should have it at hand."""

from contextlib import suppress
from pathlib import Path

from rapp_core.errors import NO_RUNTIME, CoreError, Refused
from rapp_core.launcher.sandbox import BRIDGE, is_here
from rapp_core.manifest import JAVASCRIPT, Manifest, read_manifest

NODE = Path("/usr/bin/node")  # seen in the sandbox, unlike one from elsewhere that is first on PATH
LIBRARY = Path("/usr/share/nodejs/ws")  # node-ws


def check_runtime(manifest: Manifest, node: Path = NODE, library: Path = LIBRARY) -> None:
    """Raise Refused when this robot cannot run the RApp's language; `node` and `library`: where Debian's packages put them."""
    if manifest.runtime != JAVASCRIPT:
        return
    missing = [package for package, path in (("nodejs", node), ("node-ws", library)) if not path.exists()]
    if not missing and is_here(BRIDGE):
        return
    steps = f"install the Debian packages {' and '.join(missing)}" if missing else f"install {BRIDGE} beside the core agent"
    error = Refused(f"cannot start {manifest.name}: it is written in JavaScript, which this robot cannot run; {steps}")
    error.reason = NO_RUNTIME
    raise error


def runtime_at_hand(home: Path) -> str:
    """What a spare starts ahead, beside Python: JAVASCRIPT on a robot that has a RApp in it, else nothing."""
    for package in (home / "rapps").glob("*/current"):
        with suppress(CoreError):  # a package that cannot be used needs nothing
            manifest = read_manifest(package)
            check_runtime(manifest)
            if manifest.runtime == JAVASCRIPT:
                return JAVASCRIPT
    return ""
