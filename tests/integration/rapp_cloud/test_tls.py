"""Beyond loopback everything is encrypted: what the platform serves, and what a robot's link accepts."""

import asyncio
import json
import ssl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fakes.packages import source_folder
from rapp_cloud.config import CloudConfig
from rapp_cloud.tls import make_certificate, server_tls
from rapp_hop.client import HopClient
from rapp_hop.errors import Invalid, Refused, Unreachable
from rapp_hop.hz.delivery import Delivery
from rapp_link.config import read

WORDS = [sys.executable, "-m", "rapp_cloud"]


def init(data: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [*WORDS, "init", "--data", str(data), "--robot", "nao", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)


@contextmanager
def serving(data: Path, *words: str) -> Iterator[int]:
    command = [*WORDS, "--data", str(data), "--port", "0", "--workers", "1", *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield int(json.loads(process.stdout.readline().removeprefix("READY "))["port"])
    finally:
        process.terminate()
        process.wait(20)
        process.stdout.close()


def test_a_robot_installs_over_tls_from_a_platform_that_made_its_certificate(tmp_path: Path) -> None:
    data = tmp_path / "cloud"
    told = init(data, "--host", "127.0.0.1", "--host", "cloud.example")
    certificate = data / "tls" / "certificate.pem"
    assert str(certificate) in told.stdout
    before = certificate.read_bytes()
    init(data, "--host", "127.0.0.1")
    assert certificate.read_bytes() == before  # robots have it
    token, root = (data / "robots/nao.token").read_text(), (data / "root.json").read_bytes()
    words = ("--certificate", str(certificate), "--publish", str(source_folder(tmp_path)))

    async def use(port: int) -> None:
        url = f"https://127.0.0.1:{port}"
        for ca_file, scheme in ((None, "https"), (certificate, "http")):
            other = HopClient(url.replace("https", scheme), token, ca_file=ca_file)
            with pytest.raises(Unreachable):
                await other.call("heartbeat")
            await other.close()
        client = HopClient(url, token, ca_file=certificate)
        try:
            assert (await client.call("register", {"kind": "nao", "api_version": "1.0"}))["registered"]
            assert (await Delivery(client, root, tmp_path / "robot").install("hello")).version == "1.0.0"
            seen: list[bytes] = []
            await client.download("/hop/weblets/synclist", seen.append, 2**20)
            assert f'(url "{url}/hop/weblets/download?'.encode() in b"".join(seen)
        finally:
            await client.close()

    with serving(data, *words) as port:
        asyncio.run(use(port))


def test_the_platform_does_not_serve_other_computers_in_the_clear(tmp_path: Path) -> None:
    init(tmp_path / "cloud")
    for address in ("0.0.0.0", "::"):
        command = [*WORDS, "--data", str(tmp_path / "cloud"), "--port", "0", "--address", address]
        found = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert (found.returncode, found.stdout) == (1, "")
        assert "certificate.pem" in found.stderr and "init --host" in found.stderr
        assert "Traceback" not in found.stderr


def test_which_platforms_speak_tls(tmp_path: Path) -> None:
    own = (tmp_path / "tls/certificate.pem", tmp_path / "tls/key.pem")
    for address, files in [("127.0.0.1", None), ("::1", None), ("localhost", None), ("0.0.0.0", own), ("10.0.0.7", own), ("", own)]:
        assert CloudConfig(tmp_path, address=address).tls_files == files
    assert CloudConfig(tmp_path, certificate=tmp_path / "c").tls_files == (tmp_path / "c", tmp_path / "tls/key.pem")


def test_certificates_that_cannot_be_used(tmp_path: Path) -> None:
    make_certificate(tmp_path / "a", ["localhost"])
    make_certificate(tmp_path / "b", ["localhost"])
    assert isinstance(server_tls(tmp_path / "a/certificate.pem", tmp_path / "a/key.pem"), ssl.SSLContext)
    with pytest.raises(Invalid, match="cannot use"):
        server_tls(tmp_path / "a/certificate.pem", tmp_path / "b/key.pem")
    (tmp_path / "a/key.pem").chmod(0o644)
    with pytest.raises(Refused, match="0600"):
        server_tls(tmp_path / "a/certificate.pem", tmp_path / "a/key.pem")


@pytest.mark.parametrize("url", ["http://cloud.example:9001", "http://10.0.0.7", "http://127.0.0.1.evil.example", "HTTP://cloud"])
def test_the_link_sends_no_token_in_the_clear(url: str) -> None:
    with pytest.raises(Invalid, match="without encryption"):
        read(["--cloud", url], {})


@pytest.mark.parametrize("url", ["http://127.0.0.1:9001", "http://localhost:1", "http://[::1]:9001", "https://cloud.example"])
def test_the_link_takes_loopback_and_tls(url: str) -> None:
    assert read(["--cloud", url, "--cloud-ca-file", "ca.pem"], {}).cloud_ca_file == Path("ca.pem")
