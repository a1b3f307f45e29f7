"""What runs a RApp's entry, and whether it is on this robot."""

from pathlib import Path

from rapp_core.errors import Refused
from rapp_core.launcher.sandbox import BRIDGE, is_here
from rapp_core.manifest import JAVASCRIPT, Manifest

NODE = Path("/usr/bin/node")  # seen in the sandbox, unlike one from elsewhere that is first on PATH
LIBRARY = Path("/usr/share/nodejs/ws")  # node-ws


def check_runtime(manifest: Manifest, node: Path = NODE, library: Path = LIBRARY) -> None:
    """Raise Refused when this robot cannot run the RApp's language; `node` and `library`: where Debian's packages put them."""
    if manifest.runtime != JAVASCRIPT:
        return
    missing = [package for package, path in (("nodejs", node), ("node-ws", library)) if not path.exists()]
    if missing:
        raise Refused(
            f"cannot start {manifest.name}: it is written in JavaScript, which this robot cannot run; "
            f"install the Debian packages {' and '.join(missing)}"
        )
    if not is_here(BRIDGE):
        raise Refused(
            f"cannot start {manifest.name}: it is written in JavaScript and needs rosbridge; install {BRIDGE} beside the core agent"
        )
