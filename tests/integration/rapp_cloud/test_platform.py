"""The platform as a process of its own, called as a robot calls it: register, list, profile, download, verify, install."""

import asyncio
import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import source_folder
from rapp_cloud.memory import open_memory
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.hz.delivery import Delivery, DeliveryLimits
from rapp_hop.hz.trust import Attack, Untrusted

STORE = Path(__file__).parents[3] / "store"
STOP = 5.0  # seconds; the process has 2, the machine may be busy
Test = Callable[[HopClient], Awaitable[None]]


@dataclass
class Platform:
    """A data folder and the process that serves it."""

    data: Path
    log: Path
    process: subprocess.Popen[str] | None = None
    port: int = 0

    def command(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "rapp_cloud", *words], capture_output=True, text=True, timeout=60, check=False)

    def start(self, *words: str) -> None:
        whole = [sys.executable, "-m", "rapp_cloud", "--port", "0", "--data", str(self.data), "--workers", "1", *words]
        with self.log.open("a") as log:
            self.process = subprocess.Popen(whole, stdout=subprocess.PIPE, stderr=log, text=True)
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line.startswith("READY "), self.log.read_text()
        self.port = json.loads(line[6:])["port"]

    def stop(self, number: int = signal.SIGTERM) -> int:
        assert self.process is not None and self.process.stdout is not None
        try:
            self.process.send_signal(number)
            return self.process.wait(STOP)
        finally:
            self.process.kill()
            self.process.wait()
            self.process.stdout.close()
            self.process = None

    @property
    def token(self) -> str:
        return (self.data / "robots" / "nao.token").read_text()

    @property
    def root(self) -> bytes:
        return (self.data / "root.json").read_bytes()

    def run(self, test: Test, token: str | None = None) -> None:
        async def main() -> None:
            client = HopClient(f"http://127.0.0.1:{self.port}", token or self.token)
            try:
                await test(client)
            finally:
                await client.close()

        asyncio.run(main())


@pytest.fixture
def platform(tmp_path: Path) -> Iterator[Platform]:
    platform = Platform(tmp_path / "cloud", tmp_path / "cloud.log")
    made = platform.command("init", "--data", str(platform.data), "--robot", "nao")
    assert made.returncode == 0, made.stderr
    assert platform.token not in made.stdout + made.stderr
    yield platform
    if platform.process is not None:
        platform.stop(signal.SIGKILL)


async def failure(call: Awaitable[Any]) -> HopError:
    with pytest.raises(HopError) as caught:
        await call
    return caught.value


async def register(client: HopClient) -> None:
    await client.call("register", {"robot": "nao", "kind": "nao", "api_version": "1.0"})


def test_init_keeps_secrets_private_and_may_be_repeated(platform: Platform) -> None:
    before = (platform.token, platform.root)
    assert platform.command("init", "--data", str(platform.data), "--robot", "nao").returncode == 0
    assert platform.command("init", "--data", str(platform.data), "--robot", "other").returncode == 0
    assert (platform.token, platform.root) == before
    for path in ("robots/nao.token", "robots/other.token", "platform.sqlite", "keys/root.pem"):
        assert (platform.data / path).stat().st_mode & 0o077 == 0
    assert (platform.data / "robots/other.token").read_text() != platform.token


def test_the_robot_s_day(platform: Platform, tmp_path: Path) -> None:
    """Everything of the voice-mail chain that the platform has a part in, with the store's own RApps."""
    sources = sorted(path for path in STORE.iterdir() if (path / "package.json").exists())
    platform.start(*(word for path in sources for word in ("--publish", str(path))))

    async def test(client: HopClient) -> None:
        assert "register first" in str(await failure(client.call("list_rapps")))
        assert await client.call("heartbeat") == {"registered": False, "lease": 15.0}
        assert (await client.call("register", {"robot": "nao", "kind": "nao", "api_version": "1.0"}))["registered"]
        assert (await client.call("heartbeat"))["registered"]
        rapps = {item["name"]: item for item in (await client.call("list_rapps", {"robot": "nao"}))["rapps"]}
        assert rapps.keys() == {path.name for path in sources}
        assert rapps["voice_mail"]["compatible"]
        assert "e-mail" in rapps["voice_mail"]["keywords"]["en"]
        assert await client.call("profile") == {"name": "nao", "language": "en", "contacts": []}
        phases: list[str] = []
        delivery = Delivery(client, platform.root, tmp_path / "robot")
        done = await delivery.install("voice_mail", on_phase=lambda phase, _: phases.append(phase))
        assert list(dict.fromkeys(phases)) == ["downloading", "verified", "installed"]
        for path in (STORE / "voice_mail").rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                assert (done.path / path.relative_to(STORE / "voice_mail")).read_bytes() == path.read_bytes()
        assert not (await delivery.install("voice_mail")).new
        assert list(await delivery.installed()) == ["voice_mail"]
        assert await client.call("report", {"run": {"run": "r-1", "outcome": "done"}}) == {"kept": True}
        assert await delivery.remove("voice_mail")

    platform.run(test)
    with open_memory(platform.data) as memory:
        assert [run["outcome"] for run in memory.reports.of("nao")] == ["done"]
    assert platform.token not in platform.log.read_text()


def test_a_recorded_sentence_names_its_rapp(platform: Platform, tmp_path: Path) -> None:
    platform.start("--publish", str(STORE / "voice_mail"), "--publish", str(STORE / "clock"))
    sound = tmp_path / "command.wav"
    subprocess.run(["espeak-ng", "-v", "en-us+f3", "-w", str(sound), "please tell me what time it is"], check=True, timeout=30)
    (tmp_path / "no.wav").write_bytes(b"RIFF no sound at all")

    async def test(client: HopClient) -> None:
        await register(client)
        found = await client.call("interpret", {"language": "en"}, {"recording": sound}, timeout=60)
        assert found["rapp"] == "clock"
        assert {item["rapp"] for item in found["candidates"]} == {"clock", "voice_mail"}
        error = await failure(client.call("interpret", {"language": "en"}, {"recording": tmp_path / "no.wav"}, timeout=60))
        assert isinstance(error, Invalid)
        error = await failure(client.call("interpret", {"language": "xx"}, {"recording": sound}, timeout=60))
        assert isinstance(error, Refused)

    platform.run(test)


def test_the_token_decides_who_calls(platform: Platform) -> None:
    platform.start()

    async def stranger(client: HopClient) -> None:
        for name in ("register", "list_rapps", "profile", "available_services", "nix"):
            assert (await failure(client.call(name))).status == 401

    async def robot(client: HopClient) -> None:
        for name, arguments in [
            ("register", {"kind": "nao", "api_version": "1.0"}), ("heartbeat", {}), ("profile", {}), ("report", {"run": {}}),
        ]:  # fmt: skip
            error = await failure(client.call(name, {**arguments, "robot": "other"}))
            assert isinstance(error, Refused)
            assert "another robot's" in str(error)
        for arguments in ({"kind": "nao", "api_version": "one"}, {"kind": "../x", "api_version": "1.0"}):
            assert isinstance(await failure(client.call("register", arguments)), Invalid)

    platform.run(stranger, token="x" * 43)
    platform.run(robot)


def test_publish_while_serving_and_an_update(platform: Platform, tmp_path: Path) -> None:
    first, second = source_folder(tmp_path), source_folder(tmp_path, version="1.1.0", program="print(2)\n")
    platform.start("--publish", str(first))

    async def test(client: HopClient) -> None:
        await register(client)
        delivery = Delivery(client, platform.root, tmp_path / "robot")
        assert (await delivery.install("hello")).version == "1.0.0"
        assert platform.command("publish", "--data", str(platform.data), str(second)).returncode == 0
        assert (await client.call("list_rapps"))["rapps"][0]["version"] == "1.1.0"
        assert (await delivery.install("hello")).version == "1.1.0"
        assert (tmp_path / "robot/rapps/hello/1.0.0/agent.py").exists()

    platform.run(test)


def test_s20_the_same_version_with_other_bytes_is_refused(platform: Platform, tmp_path: Path) -> None:
    source = source_folder(tmp_path)
    assert platform.command("publish", "--data", str(platform.data), str(source)).returncode == 0
    (source / "agent.py").write_text("evil()\n")
    again = platform.command("publish", "--data", str(platform.data), str(source))
    assert again.returncode == 1
    assert again.stderr.strip().splitlines() == [
        "cannot publish hello-1.0.0.hz: published with other bytes before, raise its version"
    ]
    started = platform.command("--data", str(platform.data), "--port", "0", "--publish", str(source))
    assert (started.returncode, started.stdout) == (1, "")
    both = platform.command("publish", "--data", str(platform.data), str(source), str(source_folder(tmp_path, "clock")))
    assert (both.returncode, both.stdout, both.stderr.splitlines()[0]) == (1, "on offer: clock 1.0.0\n", again.stderr.strip())


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_ends_with_its_children(platform: Platform, number: int) -> None:
    platform.start()
    assert platform.process is not None
    group = subprocess.run(["ps", "-o", "pid=", "--ppid", str(platform.process.pid)], capture_output=True, text=True, check=True)
    children = [int(word) for word in group.stdout.split()]
    assert children
    assert platform.stop(number) == 0
    for child in children:
        with pytest.raises(ProcessLookupError):
            os.kill(child, 0)


def test_without_init_it_says_what_to_do(tmp_path: Path) -> None:
    found = Platform(tmp_path, tmp_path / "log").command("--data", str(tmp_path / "nothing"), "--port", "0")
    assert found.returncode == 1
    assert "init" in found.stderr
    assert "Traceback" not in found.stderr


@pytest.mark.parametrize(
    "path",
    [
        "/tuf/keys/root.pem",
        "/tuf/metadata/../../keys/root.pem",
        "/tuf/metadata/%2e%2e/%2e%2e/keys/root.pem",
        "/tuf/targets/..%2f..%2fplatform.sqlite",
        "/tuf/targets/%252e%252e%252fplatform.sqlite",
        "/tuf/metadata/",
        "/tuf/metadata/.hidden",
        "/tuf/metadata/a%00b",
        "/platform.sqlite",
        "//etc/passwd",
    ],
)
def test_h10_nothing_but_the_store_is_served(platform: Platform, path: str) -> None:
    platform.start()
    with socket.create_connection(("127.0.0.1", platform.port), 5) as line:
        line.sendall(f"GET {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n".encode())
        answer = b"".join(iter(lambda: line.recv(65536), b""))
    assert re.match(rb"HTTP/1\.1 40[034] ", answer)
    assert b"PRIVATE" not in answer and platform.token.encode() not in answer


def test_another_store_s_root_is_not_believed(platform: Platform, tmp_path: Path) -> None:
    other = Platform(tmp_path / "other", tmp_path / "other.log")
    assert other.command("init", "--data", str(other.data), "--robot", "nao").returncode == 0
    platform.start("--publish", str(source_folder(tmp_path)))

    async def test(client: HopClient) -> None:
        error = await failure(Delivery(client, other.root, tmp_path / "robot").install("hello"))
        assert isinstance(error, Untrusted)
        assert error.attack == Attack.UNSIGNED

    platform.run(test)
    assert not (tmp_path / "robot/rapps/hello").exists()


def test_s08_a_package_changed_on_the_way_is_not_unpacked(platform: Platform, tmp_path: Path) -> None:
    platform.start("--publish", str(source_folder(tmp_path)))
    target = next((platform.data / "tuf/targets").glob("*.hz"))
    data = bytearray(target.read_bytes())
    data[len(data) // 2] ^= 1
    target.write_bytes(bytes(data))

    async def test(client: HopClient) -> None:
        phases: list[str] = []
        delivery = Delivery(client, platform.root, tmp_path / "robot")
        error = await failure(delivery.install("hello", on_phase=lambda phase, _: phases.append(phase)))
        assert isinstance(error, Untrusted)
        assert error.attack == Attack.WRONG_CONTENT
        assert "verified" not in phases
        assert list((tmp_path / "robot/downloads").iterdir()) == []

    platform.run(test)


def test_s05_an_old_copy_of_the_store_is_rollback(platform: Platform, tmp_path: Path) -> None:
    platform.start("--publish", str(source_folder(tmp_path)))
    old = (platform.data / "tuf/metadata/timestamp.json").read_bytes()
    new = source_folder(tmp_path, version="1.0.1")
    assert platform.command("publish", "--data", str(platform.data), str(new)).returncode == 0

    async def test(client: HopClient) -> None:
        delivery = Delivery(client, platform.root, tmp_path / "robot")
        assert (await delivery.install("hello")).version == "1.0.1"
        (platform.data / "tuf/metadata/timestamp.json").write_bytes(old)
        error = await failure(delivery.install("hello"))
        assert isinstance(error, Untrusted)
        assert error.attack == Attack.ROLLBACK

    platform.run(test)


def test_a_package_older_than_the_installed_one_is_not_fetched(platform: Platform, tmp_path: Path) -> None:
    platform.start("--publish", str(source_folder(tmp_path, version="1.0.9")))
    here = source_folder(tmp_path / "robot/rapps", version="1.0.10")
    (tmp_path / "robot/rapps/hello").mkdir()
    here.rename(tmp_path / "robot/rapps/hello/1.0.10")
    (tmp_path / "robot/rapps/hello/current").symlink_to("1.0.10")

    async def test(client: HopClient) -> None:
        phases: list[str] = []
        delivery = Delivery(client, platform.root, tmp_path / "robot")
        error = await failure(delivery.install("hello", on_phase=lambda phase, _: phases.append(phase)))
        assert isinstance(error, Untrusted)
        assert error.attack == Attack.ROLLBACK
        assert phases == []
        assert (await delivery.install("hello", "1.0.9")).version == "1.0.9"  # who names it, means it

    platform.run(test)


def test_v09_a_cancelled_installation_leaves_nothing_but_what_the_next_one_goes_on_from(platform: Platform, tmp_path: Path) -> None:
    source = source_folder(tmp_path)
    (source / "sound.bin").write_bytes(os.urandom(8_000_000))
    platform.start("--publish", str(source))

    async def test(client: HopClient) -> None:
        delivery = Delivery(client, platform.root, tmp_path / "robot")
        begun = asyncio.Event()

        def watch(phase: str, details: dict[str, Any]) -> None:
            if details.get("bytes"):
                begun.set()

        work = asyncio.create_task(delivery.install("hello", on_phase=watch))
        await begun.wait()
        work.cancel()
        with pytest.raises(asyncio.CancelledError):
            await work
        assert not any((tmp_path / "robot/rapps").glob("*"))
        (part,) = (tmp_path / "robot/downloads").iterdir()
        here, counts = part.stat().st_size, []
        assert (await delivery.install("hello", on_phase=lambda _, details: counts.append(details.get("bytes", 0)))).new
        assert min(filter(None, counts)) > here, "the next one goes on where the line was cut"
        assert list((tmp_path / "robot/downloads").iterdir()) == []

    platform.run(test)


def test_the_platform_away_is_unreachable(platform: Platform, tmp_path: Path) -> None:
    platform.start("--publish", str(source_folder(tmp_path)))
    platform.stop()

    async def test(client: HopClient) -> None:
        limits = DeliveryLimits(metadata_timeout=5)
        error = await failure(Delivery(client, platform.root, tmp_path / "robot", limits).install("hello"))
        assert isinstance(error, Unreachable)
        assert isinstance(await failure(client.call("profile")), Unreachable)

    platform.run(test)
