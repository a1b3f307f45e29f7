"""Files among the arguments of a call to the cloud. A file that only this process can see goes with the call, others by path."""

from pathlib import Path
from typing import Any

from rapp_api.errors import Refused

OURS = Path("/rapp")  # package and private folder, see `rapp_core.launcher.sandbox`


def sorted_out(service: str, arguments: dict[str, Any]) -> tuple[dict[str, Any], dict[str, tuple[Path, bytes]]]:
    """The plain arguments, with files that the core agent knows as {"file": path}; and the other files. Raises Refused."""
    plain: dict[str, Any] = {}
    files: dict[str, tuple[Path, bytes]] = {}
    for name, value in arguments.items():
        if not isinstance(value, Path):
            plain[name] = value
        elif value.absolute().is_relative_to(OURS):
            files[name] = (value, _content(service, value))
        else:
            plain[name] = {"file": str(value)}
    return plain, files


def _content(service: str, path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise Refused(f"cannot call {service}: the file {path} cannot be read: {error.strerror}") from error
