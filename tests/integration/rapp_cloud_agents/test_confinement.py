"""What a cloud agent sees and may use, found out from inside the real sandbox (issue: no network but two ways, limits)."""

import asyncio
import contextlib
import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.cloud_agents import Workshop, call, in_workshop, until
from rapp_cloud.cloud_agents.sandbox import Limits
from rapp_hop.errors import HopError, Refused, Unreachable

SMALL = Limits(memory=400 << 20, cpu=2, processes=24, files=64, file_size=1 << 20, private=4 << 20, silence=10.0)


@pytest.fixture
def inside(tmp_path: Path) -> Callable[[str], Any]:
    """Runs code in a cloud agent; gives its `facts`."""

    def inside(code: str, limits: Limits | None = None) -> Any:
        found: list[Any] = []

        async def test(shop: Workshop) -> None:
            found.append(await call(await shop.start(), "run", code=code))

        in_workshop(tmp_path, test, limits)
        return found[0]

    return inside


def test_it_reaches_the_platform_s_services_that_its_package_names_as_its_robot(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        agent = await shop.start(robot="nao7")
        assert await call(agent, "ask", name="greet", args={"name": "x"}) == {"caller": "nao7", "name": "x"}
        code = "Path('f').write_bytes(bytes(123_456)); facts = repository.call_wait('weigh', {'file': Path('f')})"
        assert await call(agent, "run", code=code) == 123_456
        for name in ("secret", "available_services", "../secret", "greet/../secret", "nothing"):
            with pytest.raises(HopError):
                await call(agent, "ask", name=name)
        with pytest.raises(Refused, match=r"permissions\.cloud"):
            await call(agent, "ask", name="secret")

    in_workshop(tmp_path, test)


def test_it_has_no_network(tmp_path: Path) -> None:
    """Not the Internet, not the platform's port, not the loopback, no abstract socket, no other agent's socket."""

    async def test(shop: Workshop) -> None:
        other = await shop.start()
        with contextlib.closing(socket.socket(socket.AF_UNIX)) as abstract:
            abstract.bind("\0rapp-test")
            abstract.listen()
            places: list[Any] = [("127.0.0.1", shop.port), ("127.0.0.1", 22), ("1.1.1.1", 53), ("192.168.0.1", 80)]
            paths = [
                "\0rapp-test", str(other.folders.root / "agent.socket"), str(other.folders.platform / "a_rep.socket"),
                str(shop.folder / "agents" / "platform.socket"), str(shop.doors.platform), "/run/dbus/system_bus_socket",
            ]  # fmt: skip
            code = f"""
facts = []
for family, place in {[(socket.AF_INET.value, p) for p in places] + [(socket.AF_UNIX.value, p) for p in paths]!r}:
    with socket.socket(family) as line:
        line.settimeout(1)
        try:
            line.connect(place)
            facts.append(place)
        except OSError:
            pass
try:
    facts.append(socket.getaddrinfo('example.org', 80))
except OSError:
    pass
"""
            assert await call(await shop.start(), "run", code=code) == []

    in_workshop(tmp_path, test)


def test_it_reads_no_file_of_the_platform(inside: Callable[[str], Any], tmp_path: Path) -> None:
    (tmp_path / "tokens.json").write_text("secret")
    places = [
        tmp_path / "tokens.json",
        tmp_path,
        Path(__file__),
        Path("/etc/shadow"),
        Path("/etc/passwd"),
        Path("/home"),
        Path("/var"),
    ]
    code = f"""
facts = []
for place in {[str(place) for place in places]!r}:
    if os.path.isfile(place) or (os.path.isdir(place) and os.listdir(place)):
        facts.append(place)
facts += [name for name in os.environ if name not in ("PATH", "HOME", "TMPDIR", "LANG", "LC_CTYPE", "PWD", "MALLOC_ARENA_MAX")
          and not name.startswith(("RAPP_AGENT", "PYTHON"))]
facts += os.listdir("/proc")
"""
    assert inside(code) == []


def test_it_writes_in_its_private_folder_only(inside: Callable[[str], Any]) -> None:
    code = """
facts = []
rapp = ["/rapp", "/rapp/package", "/rapp/platform", "/rapp/python"]
for place in ("/", "/tmp", "/usr", "/etc", *rapp, "/dev", "/proc", sys.prefix, "."):
    try:
        open(os.path.join(place, "written"), "w").close()
        facts.append(place)
    except OSError:
        pass
"""
    assert inside(code) == ["."]


def test_it_is_nobody_alone_and_without_descriptors(inside: Callable[[str], Any]) -> None:
    code = """
import stat, threading
mine = {1, os.getpid(), os.getppid(), *(thread.native_id for thread in threading.enumerate())}
facts = {"uid": os.getuid(), "killed": [], "open": []}
try:
    os.setuid(0)
    facts["uid"] = 0
except OSError:
    pass
for pid in range(1, 2000):
    if pid not in mine:
        try:
            os.kill(pid, 0)
            facts["killed"].append(pid)
        except OSError:
            pass
for number in range(3, 60):
    try:
        mode = os.fstat(number).st_mode
        facts["open"] += [number] if stat.S_ISDIR(mode) or stat.S_ISREG(mode) else []
    except OSError:
        pass
"""
    facts = inside(code)
    assert facts["uid"] != 0
    assert (facts["killed"], facts["open"]) == ([], [])
    if os.geteuid() == 0:
        assert 65500 <= facts["uid"] < 65534


def test_memory_processes_files_and_disk_are_limited(inside: Callable[..., Any]) -> None:
    code = """
facts = {}
try:
    facts["memory"] = len(bytearray(600 << 20))
except MemoryError:
    facts["memory"] = 0
children = []
try:
    while len(children) < 200:
        pid = os.fork()
        if pid == 0:
            time.sleep(30)
            os._exit(0)
        children.append(pid)
except OSError:
    pass
facts["processes"] = len(children)
for pid in children:
    os.kill(pid, 9)
    os.waitpid(pid, 0)
kept = []
try:
    while len(kept) < 500:
        kept.append(os.open("/dev/null", os.O_RDONLY))
except OSError:
    pass
for number in kept:
    os.close(number)
facts["files"] = len(kept)
def fill(name, pieces):
    written = 0
    try:
        with open(name, "wb", buffering=0) as file:
            for _ in range(pieces):
                written += file.write(bytes(1 << 18))
    except OSError:
        pass
    return written
facts["file"] = fill("one", 50)
facts["disk"] = sum(fill(f"file{number}", 4) for number in range(20))
"""
    facts = inside(code, SMALL)
    assert facts["memory"] == 0
    assert 0 < facts["processes"] < SMALL.processes
    assert 0 < facts["files"] < SMALL.files
    assert facts["file"] == SMALL.file_size
    assert 0 < facts["disk"] <= SMALL.private


async def excess(shop: Workshop, code: str, words: str) -> None:
    """It is noticed that an agent running `code` takes too much."""
    agent = await shop.start()
    running = asyncio.create_task(call(agent, "run", code=code))
    while not agent.problem:
        await shop.engine.check()
        await asyncio.sleep(0.05)
    assert words in agent.problem
    await agent.stop()
    with pytest.raises(Unreachable):
        await running


def test_what_all_its_processes_take_together_is_limited(tmp_path: Path) -> None:
    """Each of them stays within the kernel's limit."""
    hungry = """
for _ in range(6):
    if os.fork() == 0:
        kept = bytearray(os.urandom(1) * (100 << 20))
        time.sleep(60)
        os._exit(0)
time.sleep(60)
"""
    busy = """
for _ in range(3):
    if os.fork() == 0:
        until = time.process_time() + 1.5
        while time.process_time() < until: pass
        os._exit(0)
for _ in range(3): os.wait()
time.sleep(60)
"""

    async def test(shop: Workshop) -> None:
        await excess(shop, hungry, "memory")
        await excess(shop, busy, "processor time")

    in_workshop(tmp_path, test, SMALL)


def test_a_flood_of_words_is_cut(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        agent = await shop.start()
        with contextlib.suppress(HopError):
            await call(agent, "run", code="while True: os.write(1, bytes(100_000))")
        assert agent.folders.log.stat().st_size <= SMALL.file_size

    in_workshop(tmp_path, test, SMALL)


@pytest.mark.parametrize(
    ("program", "words"),
    [
        ("echo 'bwrap: No permissions to create new namespace' >&2\nexit 1", "No permissions to create new namespace"),
        ("exit 0", "without a word"),
        (None, "No such file"),
    ],
)
def test_where_confinement_is_impossible_nothing_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str | None, words: str
) -> None:
    folder = tmp_path / "bin"
    folder.mkdir()
    if program is not None:
        (folder / "bwrap").write_text(f"#!/bin/sh\n{program}\n")
        (folder / "bwrap").chmod(0o755)
    monkeypatch.setenv("PATH", str(folder))
    proof = tmp_path / "ran"

    async def test(shop: Workshop) -> None:
        with pytest.raises(Refused, match="cannot confine a cloud agent here") as caught:
            await shop.start(f"open({str(proof)!r}, 'w')")
        assert words in str(caught.value)
        assert list((tmp_path / "agents" / "runs").iterdir()) == []

    in_workshop(tmp_path, test)
    assert not proof.exists()


def test_its_memory_is_its_own_and_ends_with_it(tmp_path: Path) -> None:
    async def test(shop: Workshop) -> None:
        first, second = await shop.start(), await shop.start()
        await call(first, "run", code="Path('note').write_text('x')")
        assert await call(second, "run", code="facts = os.listdir('.')") in ([], ["uploads"])
        await first.stop()
        assert not first.folders.root.exists()
        await until(lambda: not first.process.alive)

    in_workshop(tmp_path, test)
