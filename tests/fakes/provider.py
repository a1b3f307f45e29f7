"""An author on another computer: a home of their own, what the platform's owner gave them, and the commands they type."""

import asyncio
import contextlib
import io
from pathlib import Path

import pytest

from fakes.cloud_process import PATIENCE, CloudProcess
from rapp_cli.__main__ import main as rapp
from rapp_cloud.memory import open_memory
from rapp_cloud.tls import make_certificate
from rapp_hop.client import HopClient
from rapp_hop.errors import Refused


class Provider:
    """Commands are run in this process; what they say is in `out` and `err`."""

    def __init__(self, name: str, cloud: CloudProcess, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.name = name
        self.home = folder / name
        self.home.mkdir()
        self.token = self.home / "token"
        self.out = self.err = ""
        self._cloud = cloud
        self._patch = patch
        patch.setenv("RAPP_ROOT_FILE", str(cloud.data / "root.json"))
        patch.setenv("RAPP_CLOUD_CA_FILE", str(certificate_of(cloud)))

    @property
    def url(self) -> str:
        """The platform's."""
        return f"https://127.0.0.1:{self._cloud.port}"

    @property
    def file(self) -> Path:
        """What asks for their key to be known."""
        return self.home / f"{self.name}.publisher"

    def run(self, capsys: pytest.CaptureFixture[str], *words: str, given: str = "") -> int:
        """A command; gives its exit status."""
        self._patch.setenv("RAPP_TOKEN_FILE", str(self.token))
        self._patch.setattr("sys.stdin", io.StringIO(given))
        capsys.readouterr()
        status = rapp(list(words))
        self.out, self.err = capsys.readouterr()
        return status

    def far(self, capsys: pytest.CaptureFixture[str], *words: str) -> int:
        """A command about the platform, typed at home."""
        return self.run(capsys, *words, "--cloud", self.url, "--home", str(self.home))

    def owner(self, capsys: pytest.CaptureFixture[str], *words: str) -> int:
        """A command that the platform's owner types beside its data."""
        return self.run(capsys, *words, "--data", str(self._cloud.data))

    def join(self, capsys: pytest.CaptureFixture[str], *names: str) -> None:
        """Become a publisher with a token, a key and these names."""
        self.give_token()
        assert self.run(capsys, "keys", "own", self.name, "--home", str(self.home), "-o", str(self.file)) == 0
        assert self.owner(capsys, "keys", "new", self.name, "--public", str(self.file)) == 0
        assert self.owner(capsys, "keys", "grant", self.name, *names) == 0

    def give_token(self, *scopes: str) -> str:
        """Give them a token, in the place of the one they had; returns its text."""
        with open_memory(self._cloud.data) as memory:
            memory.accounts.open(self.name, "publisher")
            text = memory.accounts.give(self.name, scopes)
        self.token.write_text(text)
        self.token.chmod(0o600)
        self.wait_until_known()
        return text

    def wait_until_known(self) -> None:
        """Wait until the platform has seen the token that was made beside it."""
        asyncio.run(self._known(self.token.read_text()))

    async def _known(self, token: str) -> None:
        client = HopClient(self.url, token, ca_file=certificate_of(self._cloud))
        try:
            async with asyncio.timeout(PATIENCE):
                while True:
                    with contextlib.suppress(Refused):
                        await client.call("available_services")
                        return
                    await asyncio.sleep(0.05)
        finally:
            await client.close()


def make_tls(folder: Path) -> dict[str, Path]:
    """Make a certificate for this computer; gives the settings of a platform that uses it."""
    certificate = make_certificate(folder / "tls", ["127.0.0.1"])
    return {"certificate": certificate, "certificate_key": certificate.with_name("key.pem")}


def certificate_of(cloud: CloudProcess) -> Path:
    """What `make_tls` has made for it."""
    return cloud.data.parent / "tls" / "certificate.pem"
