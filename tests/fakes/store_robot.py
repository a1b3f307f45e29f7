"""A robot that installs from a store which is attacked."""

import asyncio
from datetime import timedelta
from pathlib import Path

import pytest

from fakes.repository import PUBLISHER, Client, Repository
from rapp_hop.hz.delivery import Delivery, DeliveryLimits, Recipient
from rapp_hop.hz.install import Installed
from rapp_hop.hz.trust import Attack, Untrusted

YEARS = timedelta(days=3653)
NAO = Recipient("nao1", "nao", "1.0")
ALL = [PUBLISHER, "targets", "snapshot", "timestamp"]


class Robot:
    """Has hello 1.0.0, while its store offers 1.1.0."""

    def __init__(self, repository: Repository, home: Path) -> None:
        self.client = Client(repository)
        self.home = home
        self.old: dict[str, bytes] = {}  # what an attacker may have kept of the line
        limits = DeliveryLimits(window=0.2)
        self.delivery = Delivery(self.client, repository.trusted_root, home, limits)  # type: ignore[arg-type]

    async def installs(self, name: str = "hello", version: str | None = None) -> Installed:
        self.phases: list[str] = []
        return await self.delivery.install(name, version, lambda phase, _: self.phases.append(phase), NAO)

    def gets(self, name: str = "hello", version: str | None = None) -> str:
        return asyncio.run(self.installs(name, version)).version

    def refuses(self, attack: Attack, name: str = "hello") -> None:
        with pytest.raises(Untrusted) as caught:
            self.gets(name)
        assert (caught.value.attack, caught.value.reason) == (attack, attack.value), str(caught.value)
        self.is_as_before()

    def is_as_before(self) -> None:
        """Nothing was unpacked, of the download is left at most what the next one goes on from, the old version runs."""
        assert not {"verified", "installed"} & set(self.phases)
        installed = self.delivery.folder.find("hello")
        assert installed is not None and installed.version == "1.0.0"
        assert (installed.path / "agent.py").read_text() == "print('1.0.0')\n"
        assert sorted(path.name for path in (self.home / "rapps" / "hello").iterdir()) == ["1.0.0", "current"]
        assert [path.name for path in (self.home / "rapps").iterdir() if path.name != ".lock"] == ["hello"]
        downloads = self.home / "downloads"
        assert not downloads.exists() or {path.suffix for path in downloads.iterdir()} <= {".part"}
