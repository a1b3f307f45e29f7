"""O03, a certificate expires at midnight: it is told before, refused after, and renewed without a restart."""

import asyncio
import datetime
import errno
import json
import logging
import os
import ssl
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.client import HTTPSConnection
from pathlib import Path
from unittest.mock import Mock

import pytest

from fakes.authority import BEGIN, LATER, Authority
from fakes.cloud_process import CloudProcess
from rapp_cloud.__main__ import main
from rapp_cloud.certificate import REMIND, Certificate
from rapp_cloud.files import write_whole
from rapp_cloud.tls import CERTIFICATE, WARNING, may_be_made_anew, server_tls
from rapp_hop.client import HopClient
from rapp_hop.connecting import NOT_SENT
from rapp_hop.errors import HopError, Unreachable

PATIENCE = 60.0  # s
GONE = datetime.datetime(2021, 1, 1, tzinfo=datetime.UTC)
MIDNIGHT = datetime.datetime(2030, 1, 1, tzinfo=datetime.UTC)


def _until(true: Callable[[], bool], what: Callable[[], object] = lambda: None) -> None:
    deadline = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < deadline, what()
        time.sleep(0.05)


class Files:
    """Certificate and key on the disk."""

    def __init__(self, folder: Path) -> None:
        self.certificate, self.key = folder / "platform.pem", folder / "platform.key"

    def put(self, pair: tuple[bytes, bytes]) -> None:
        write_whole(self.key, pair[1], mode=0o600)
        write_whole(self.certificate, pair[0])


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority(tmp_path)


@pytest.fixture
def files(tmp_path: Path) -> Files:
    return Files(tmp_path)


@pytest.fixture
def clock() -> list[float]:
    return [BEGIN.timestamp() + 1]


@pytest.fixture
def shown(files: Files, authority: Authority, clock: list[float]) -> Certificate:
    files.put(authority.issue(MIDNIGHT))
    return Certificate(files.certificate, files.key, lambda: clock[0])


@pytest.fixture
def platform(tmp_path: Path, files: Files, authority: Authority) -> Iterator[CloudProcess]:
    """One whose certificate has expired."""
    files.put(authority.issue(GONE))
    cloud = CloudProcess(tmp_path, [], certificate=files.certificate, certificate_key=files.key)
    cloud.start()
    try:
        yield cloud
    finally:
        cloud.stop()


@contextmanager
def link(cloud: CloudProcess, ca_file: Path, folder: Path) -> Iterator[Path]:
    """A robot's link that has been registered before; gives its log. Its bridge is away."""
    (folder / "link").mkdir(parents=True)
    (folder / "link" / "robot.json").write_text(json.dumps({"robot": "nao", "kind": "nao", "api_version": "1.0"}))
    words = [sys.executable, "-m", "rapp_link", "--home", str(folder), "--bridge", "ws://127.0.0.1:9"]
    words += ["--cloud", f"https://127.0.0.1:{cloud.port}", "--cloud-ca-file", str(ca_file)]
    words += ["--token-file", str(cloud.data / "robots" / "nao.token")]
    log = folder / "log"
    with log.open("w") as file:
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=file)
    try:
        yield log
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE)
        finally:
            process.kill()
            process.wait()


class Watcher:
    """A connection that trusts everything, kept open over all that it asks."""

    def __init__(self, port: int) -> None:
        trusting = ssl.create_default_context()
        trusting.check_hostname, trusting.verify_mode = False, ssl.CERT_NONE
        self._line = HTTPSConnection("127.0.0.1", port, timeout=PATIENCE, context=trusting)
        self._line.connect()
        self._socket = self._line.sock

    def get(self, path: str) -> tuple[int, str]:
        self._line.request("GET", path)
        with self._line.getresponse() as answer:
            found = answer.status, answer.read().decode()
        assert self._line.sock is self._socket, "the connection was cut"
        return found

    def number(self, name: str) -> float:
        lines = self.get("/metrics")[1].splitlines()
        return next(float(line.split()[1]) for line in lines if line.startswith(f"{name} "))

    def close(self) -> None:
        self._line.close()


def test_o03_a_certificate_expires_and_is_renewed_without_a_restart(
    platform: CloudProcess, files: Files, authority: Authority, tmp_path: Path
) -> None:
    token = (platform.data / "robots" / "nao.token").read_text()

    def call() -> HopError | None:
        async def failure() -> HopError | None:
            client = HopClient(f"https://127.0.0.1:{platform.port}", token, ca_file=authority.file)
            try:
                await client.call("heartbeat")
            except HopError as error:
                return error
            finally:
                await client.close()
            return None

        return asyncio.run(failure())

    watcher, process = Watcher(platform.port), platform.pid
    with link(platform, authority.file, tmp_path / "robot") as log:
        error = call()
        assert isinstance(error, Unreachable) and error.reason == NOT_SENT
        assert "its certificate has expired; who runs it must renew it" in str(error)
        _until(lambda: "its certificate has expired; who runs it must renew it" in log.read_text(), log.read_text)
        assert "the certificate has expired at 2021-01-01 00:00:00 UTC" in platform.log.read_text()
        status, text = watcher.get("/readyz")
        assert status == 503 and "platform.pem has expired" in text
        assert json.loads(text)["certificate_expires"] == "2021-01-01 00:00:00 UTC"
        assert watcher.number("rapp_certificate_expires_seconds") < 0

        write_whole(files.certificate, b"-----BEGIN CERTIFICATE-----\nnonsense\n-----END CERTIFICATE-----\n")
        _until(lambda: "meanwhile the certificate of before stays" in platform.log.read_text(), platform.log.read_text)
        assert "its certificate has expired" in str(call())

        files.put(authority.issue())
        _until(lambda: call() is None, platform.log.read_text)
        _until(lambda: watcher.number("rapp_robots") == 1.0, log.read_text)
        assert watcher.number("rapp_certificate_expires_seconds") > 0
        _until(lambda: watcher.get("/readyz")[0] == 200)
        assert json.loads(watcher.get("/readyz")[1])["certificate_expires"] == "2100-01-01 00:00:00 UTC"
    watcher.close()
    assert platform.pid == process
    assert platform.stop() == 0
    assert "Traceback" not in platform.log.read_text()


def test_o03_new_files_are_taken_when_they_lie_still(
    shown: Certificate, files: Files, authority: Authority, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    certificate, key = authority.issue()
    before = shown.until
    write_whole(files.certificate, certificate)
    shown.look()
    write_whole(files.key, key, mode=0o600)
    shown.look()
    assert shown.until == before
    shown.look()
    assert shown.until == LATER.timestamp()
    assert [record.levelname for record in caplog.records] == ["INFO"]
    shown.look()
    assert len(caplog.records) == 1


@pytest.mark.parametrize("how", ["half", "no key for it", "open key", "gone", "expired", "not yet", "nonsense"])
def test_o03_what_is_wrong_with_new_files_is_said_once_and_mended(
    shown: Certificate, files: Files, authority: Authority, caplog: pytest.LogCaptureFixture, how: str
) -> None:
    begin, end = MIDNIGHT if how == "not yet" else BEGIN, BEGIN if how == "expired" else LATER
    certificate, key = authority.issue(end, begin)
    files.put({"half": (certificate[:200], key), "no key for it": (certificate, authority.issue()[1]),
               "nonsense": (b"nonsense", key)}.get(how, (certificate, key)))  # fmt: skip
    if how == "open key":
        files.key.chmod(0o640)
    if how == "gone":
        files.certificate.unlink()
    for _ in range(4):
        shown.look()
    assert shown.until == MIDNIGHT.timestamp()
    (line,) = [record.getMessage() for record in caplog.records]
    assert line.startswith("cannot use") and "good until 2030-01-01 00:00:00 UTC" in line
    files.put(authority.issue())
    for _ in range(2):
        shown.look()
    assert shown.until == LATER.timestamp()


def test_o03_files_that_are_not_good_yet_are_taken_when_they_are(
    shown: Certificate, files: Files, authority: Authority, clock: list[float], caplog: pytest.LogCaptureFixture
) -> None:
    files.put(authority.issue(LATER, MIDNIGHT))
    for _ in range(3):
        shown.look()
    assert shown.until == MIDNIGHT.timestamp() and len(caplog.records) == 1
    clock[0] = MIDNIGHT.timestamp()
    shown.look()
    assert shown.until == LATER.timestamp()


def test_o03_files_that_could_not_be_opened_for_a_moment_are_taken_later(
    shown: Certificate, files: Files, authority: Authority, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    files.put(authority.issue())
    with monkeypatch.context() as moment:
        moment.setattr(Path, "read_bytes", Mock(side_effect=OSError(errno.EMFILE, os.strerror(errno.EMFILE))))
        for _ in range(3):
            shown.look()
    assert shown.until == MIDNIGHT.timestamp()
    assert [record.getMessage().partition(": ")[2].partition(";")[0] for record in caplog.records] == ["Too many open files"]
    shown.look()
    assert shown.until == LATER.timestamp()


def test_o03_the_end_is_told_two_weeks_before_once_a_day(
    shown: Certificate, files: Files, authority: Authority, clock: list[float], caplog: pytest.LogCaptureFixture
) -> None:
    def said() -> list[str]:
        caplog.clear()
        shown.look()
        return [record.levelname for record in caplog.records]

    assert said() == []
    clock[0] = MIDNIGHT.timestamp() - WARNING - 1
    assert said() == []
    clock[0] += 2
    assert said() == ["WARNING"]
    assert "expires at 2030-01-01 00:00:00 UTC" in caplog.text
    assert said() == []
    clock[0] += REMIND
    assert said() == ["WARNING"]
    clock[0] = MIDNIGHT.timestamp() + REMIND
    assert said() == ["ERROR"]
    assert shown.left() == -REMIND
    files.put(authority.issue())
    assert [*said(), *said()] == []
    assert shown.left() > WARNING


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("not yet", "not good yet; set this computer's clock"),
        ("expired", "has expired; who runs it must renew it"),
        ("stranger", "nobody whom this computer trusts vouches for its certificate"),
        ("other name", "is for another name"),
    ],
)
def test_o03_a_client_says_why_it_does_not_trust(files: Files, authority: Authority, tmp_path: Path, how: str, words: str) -> None:
    pairs = {
        "not yet": authority.issue(begin=MIDNIGHT + datetime.timedelta(days=10_000)),
        "expired": authority.issue(GONE),
        "stranger": Authority(tmp_path, "stranger").issue(),
        "other name": authority.issue(address="192.0.2.1"),
    }
    files.put(pairs[how])

    async def failure() -> HopError:
        tls = server_tls(files.certificate, files.key)
        server = await asyncio.start_server(lambda _reader, writer: writer.close(), "127.0.0.1", 0, ssl=tls)
        client = HopClient(f"https://127.0.0.1:{server.sockets[0].getsockname()[1]}", ca_file=authority.file)
        try:
            with pytest.raises(Unreachable, match="cannot trust https") as caught:
                await client.call("heartbeat")
            return caught.value
        finally:
            await client.close()
            server.close()
            await server.wait_closed()

    assert words in str(asyncio.run(failure()))


def test_o03_init_makes_only_its_own_certificates_anew(
    tmp_path: Path, files: Files, authority: Authority, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = tmp_path / "cloud"
    words, own = ["init", "--data", str(data), "--robot", "nao", "--host", "localhost"], data / "tls" / CERTIFICATE
    monkeypatch.setattr("rapp_cloud.tls._LASTS", datetime.timedelta(days=13))
    assert main(words) == 0
    first = own.read_bytes()
    monkeypatch.undo()
    assert main(words) == 0
    second = own.read_bytes()
    assert main(words) == 0
    assert own.read_bytes() == second != first
    files.put(authority.issue(GONE))
    own.write_bytes(files.certificate.read_bytes())
    assert main(words) == 0
    assert own.read_bytes() == files.certificate.read_bytes()
    for wrong in (b"x", None):
        own.unlink() if wrong is None else own.write_bytes(wrong)
        with pytest.raises(HopError, match="cannot read"):
            may_be_made_anew(own)
