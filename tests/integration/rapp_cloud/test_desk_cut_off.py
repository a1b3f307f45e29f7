"""A platform that is killed, or whose disk is full, at any step of a publisher's change: the old state or the new one."""

import json
import os
import signal
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from fakes.cloud_process import PATIENCE, CloudProcess, cloud_process
from fakes.packages import source_folder
from fakes.provider import Provider, certificate_of, make_tls
from fakes.publisher import Publisher
from rapp_cloud.shelf import Shelf
from rapp_hop.hz.archive import build

SCRIPT = Path(__file__).with_name("desk_cut_off.py")
TESTS = SCRIPT.parents[2]


@pytest.fixture(scope="module")
def begin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with maria's clock 1.0.0, what she would hand in next, and a robot that has seen it."""
    folder = tmp_path_factory.mktemp("begin")
    shelf = Shelf(folder / "tuf", folder / "keys")
    shelf.create()
    maria = Publisher("maria", shelf, folder)
    maria.join("clock")
    for version in ("1.0.0", "1.1.0"):
        (folder / f"clock-{version}.hz").write_bytes(build(source_folder(folder / "sources", "clock", version)))
    first = (folder / "clock-1.0.0.hz").read_bytes()
    shelf.desk.publish("maria", folder / "clock-1.0.0.hz", maria.list_with(first), lambda *_: None, 2**30)
    (folder / "publish.list").write_bytes(maria.list_with((folder / "clock-1.1.0.hz").read_bytes()))
    (folder / "yank.list").write_bytes(maria.signed(maria.standing.without("clock", "1.0.0")))
    (folder / "maria.pem").write_bytes(maria.key.private_bytes)
    (folder / "next.pem").write_bytes(Publisher("next", shelf, folder).key.private_bytes)
    (folder / "maria-seen").rename(folder / "robot")
    return folder


OLD = {"offered": ["1.0.0"], "yanked": [], "old key": True, "platform": ["1.0.0"]}
TABLE = [
    ("publish", {"offered": ["1.0.0", "1.1.0"], "platform": ["1.0.0", "1.1.0"]}),
    ("yank", {"offered": [], "yanked": ["1.0.0"], "platform": []}),
    ("rotate", {"old key": False}),
]


@pytest.mark.parametrize("how", ["killed", "full"])
@pytest.mark.parametrize(("operation", "changes"), TABLE, ids=[row[0] for row in TABLE])
def test_every_step(begin: Path, tmp_path: Path, operation: str, changes: dict[str, Any], how: str) -> None:
    words = [sys.executable, str(SCRIPT), str(begin), str(tmp_path / "work"), operation, how]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(words, env=env, capture_output=True, text=True, timeout=110, check=False)
    assert done.returncode == 0, done.stderr
    tries = [json.loads(line) for line in done.stdout.splitlines()]
    print(f"{operation}, {how}: {len(tries)} steps")
    new = {**OLD, **changes}
    for told in tries:
        assert "fault" not in told, told["fault"]
        assert told["after"] in (OLD, new), told
        assert told["end"] == new, told
        assert told["again"] == "" or told["after"] == new, told
    assert [told["after"] for told in (tries[0], tries[-1])] == [OLD, new]
    if how == "killed":
        assert [told["killed"] for told in tries] == [True] * (len(tries) - 1) + [False]
    else:
        assert all("No space left" in told["error"] or told["error"] == "" for told in tries)
        assert "No space left" in tries[0]["error"]


LENGTH = 2**21  # bytes of an upload


@contextmanager
def half_sent(cloud: CloudProcess, token: str) -> Iterator[None]:
    """Somebody who hands in a package, and has come to its middle."""
    context = ssl.create_default_context(cafile=str(certificate_of(cloud)))
    head = (
        f"POST /hop/publish_package HTTP/1.1\r\nHost: 127.0.0.1\r\nAccept-Token: {token}\r\nContent-Length: {LENGTH}\r\n"
        "Accept: application/json\r\nContent-Type: multipart/form-data; boundary=b\r\n\r\n"
    )
    plain = socket.create_connection(("127.0.0.1", cloud.port), PATIENCE)
    with context.wrap_socket(plain, server_hostname="127.0.0.1") as line:
        line.sendall(head.encode() + bytes(LENGTH // 2))
        yield


def test_a_line_that_is_cut_and_a_platform_that_is_killed_in_mid_upload(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with cloud_process(tmp_path, [source_folder(tmp_path)], **make_tls(tmp_path)) as cloud:
        maria = Provider("maria", cloud, tmp_path, monkeypatch)
        maria.join(capsys, "clock")
        words = {"keywords": {"en": ["clock"]}, "sentences": {"en": ["what time is it"]}}
        assert maria.far(capsys, "publish", str(source_folder(tmp_path, "clock", **words))) == 0, maria.err
        before = sorted(path.name for path in (cloud.data / "tuf").rglob("*.hz"))
        with half_sent(cloud, maria.token.read_text()):
            pass
        with half_sent(cloud, maria.token.read_text()):
            cloud.stop(signal.SIGKILL)
        cloud.start()
        assert maria.far(capsys, "store", "list") == 0, maria.err
        assert "clock                    1.0.0" in maria.out
        assert maria.far(capsys, "publish", str(source_folder(tmp_path, "clock", "1.1.0", **words))) == 0, maria.err
        after = sorted(path.name for path in (cloud.data / "tuf").rglob("*.hz"))
        assert [name.partition(".")[2] for name in after if name not in before] == ["clock-1.1.0.hz"]
        deadline = time.monotonic() + PATIENCE
        while left := [path for path in (cloud.data / "uploads").rglob("*") if path.exists()]:
            assert time.monotonic() < deadline, left
            time.sleep(0.05)
