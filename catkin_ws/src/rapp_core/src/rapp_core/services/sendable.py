"""Which files a RApp may send to the cloud: recordings of its run, what it has kept, and what it hands over with a call."""

import re
import secrets
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_core.config import Config
from rapp_core.errors import Invalid, Refused, Unreachable
from rapp_core.ports import Agent

_ENDING = re.compile(r"\.[a-z0-9]{1,8}")


@dataclass(frozen=True)
class CallFile:
    """A file that only the dynamic agent sees, as a parameter of a call."""

    parameter: str
    name: str  # only its ending is used
    data: bytes


class Sendable:
    """The files of one run."""

    def __init__(self, run: Agent, config: Config) -> None:
        self._folder = run.recordings
        self._most = config.limits.sent
        self._allowed = [run.recordings.resolve()]
        if run.manifest is not None:
            self._allowed.append((config.home / "keepsakes").resolve() / run.manifest.name)

    def check(self, arguments: Mapping[str, Any]) -> None:
        """Raise Refused when an argument {"file": path} is a file that may not be sent."""
        for value in arguments.values():
            if isinstance(value, dict) and value.keys() == {"file"}:
                path = Path(str(value["file"]))
                if not path.is_absolute() or not any(path.resolve().is_relative_to(folder) for folder in self._allowed):
                    raise Refused(f"cannot send {str(path)[:200]}: only recordings of this run and kept files may leave the robot")

    @contextmanager
    def written(self, files: Sequence[CallFile]) -> Iterator[dict[str, dict[str, str]]]:
        """Have files on the disk for the link while a call runs; gives them as arguments. Raises Invalid, Refused, Unreachable."""
        size = sum(len(file.data) for file in files)
        if size > self._most:
            raise Refused(f"cannot send {size} bytes with a call: {self._most} are allowed; send less")
        if len({file.parameter for file in files}) != len(files):
            raise Invalid("cannot send the files: a parameter is given twice")
        paths: dict[str, Path] = {}
        try:
            for file in files:
                ending = Path(file.name).suffix.lower()
                paths[file.parameter] = self._folder / f".sent-{secrets.token_hex(6)}{ending if _ENDING.fullmatch(ending) else ''}"
                paths[file.parameter].write_bytes(file.data)
            yield {name: {"file": str(path)} for name, path in paths.items()}
        except OSError as error:
            raise Unreachable(f"cannot send the files: {error.strerror}; see the disk of {self._folder}") from error
        finally:
            for path in paths.values():
                path.unlink(missing_ok=True)
