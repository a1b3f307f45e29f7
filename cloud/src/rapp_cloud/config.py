"""The platform's settings, in one screen: defaults, then `<data>/cloud.toml`, then the environment, then options."""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from rapp_cloud.tls import CERTIFICATE, KEY, is_loopback
from rapp_hop.errors import Invalid

FILE = "cloud.toml"
PREFIX = "RAPP_CLOUD_"
_TYPES: dict[str, type[Any]] = {
    "address": str, "passphrase": str, "port": int, "workers": int, "agents": int, "agents_of_one": int,
    "publisher_quota": int, "database": str, "passphrase_file": Path, "certificate": Path, "certificate_key": Path,
}  # fmt: skip  # others: float


@dataclass(frozen=True)
class CloudConfig:
    """One platform."""

    data: Path  # everything the platform keeps
    address: str = "127.0.0.1"  # to listen on
    port: int = 9001  # 0: any free one
    certificate: Path | None = None  # PEM, for TLS; None: none on loopback, else what `init --host` made
    certificate_key: Path | None = None  # PEM; None: <data>/tls/key.pem
    database: str | None = field(default=None, repr=False)  # URL, may hold a password; None: SQLite in the data folder
    passphrase: str | None = field(default=None, repr=False)  # of the store's keys; only from the environment
    passphrase_file: Path | None = None  # the same out of a file; neither: beside the keys
    publish: tuple[Path, ...] = ()  # sources of RApps to offer at start
    workers: int = os.cpu_count() or 1  # processes for interpretation
    interpret_timeout: float = 30.0  # seconds for one sentence
    lease: float = 15.0  # seconds without a heartbeat until a robot counts as gone
    agents: int = 32  # cloud agents at once
    agents_of_one: int = 4  # of one robot
    publisher_quota: int = 1024  # MiB of all packages and lists of one publisher who publishes from elsewhere
    refresh: float = 3600.0  # seconds between two new timestamps of the store

    @property
    def tls_files(self) -> tuple[Path, Path] | None:
        """Certificate and key; None: this platform speaks plain HTTP, which it does on loopback only."""
        if self.certificate is None and is_loopback(self.address):
            return None
        own = self.data / "tls"
        return self.certificate or own / CERTIFICATE, self.certificate_key or own / KEY


def load_config(data: Path, options: Mapping[str, Any], environment: Mapping[str, str]) -> CloudConfig:
    """Return the settings; an option that is None was not given.

    :raises Invalid: when a setting is unknown or of another type
    """
    given: dict[str, Any] = {}
    path = data / FILE
    if path.exists():
        try:
            given |= tomllib.loads(path.read_text("utf-8"))
        except (OSError, ValueError) as error:
            raise Invalid(f"cannot read {path}: {error}") from None
    names = {field.name for field in fields(CloudConfig)} - {"data"}
    for name in names:
        if PREFIX + name.upper() in environment:
            text = environment[PREFIX + name.upper()]
            given[name] = text.split(os.pathsep) if name == "publish" else text
    given |= {name: value for name, value in options.items() if value is not None}
    strange = sorted(set(given) - names)
    if strange:
        raise Invalid(f"cannot use the setting {strange[0]!r}: known are {', '.join(sorted(names))}")
    return replace(CloudConfig(data), **{name: _typed(name, value) for name, value in given.items()})


def _typed(name: str, value: Any) -> Any:
    if name == "publish":
        if not isinstance(value, list):
            raise Invalid("cannot use the setting publish: it must be a list of folders")
        return tuple(Path(item) for item in value)
    kind = _TYPES.get(name, float)
    try:
        if isinstance(value, bool) or (kind in (str, Path) and not isinstance(value, str | Path)):
            raise TypeError
        found = kind(value)
    except (TypeError, ValueError):
        raise Invalid(f"cannot use {value!r} as the setting {name}: it must be of type {kind.__name__}") from None
    if kind in (int, float) and not 0 <= found <= 1e6:
        raise Invalid(f"cannot use {value!r} as the setting {name}: it must be within 0 and 1000000")
    return found
