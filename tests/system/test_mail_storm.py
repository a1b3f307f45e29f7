"""Two hundred mails with random faults on their way, link and server killed at random points: none is lost, none comes twice.

The link's own parts run as a process (`fakes.mail_half`), the mail server is the real one, the faults are in the line between.
"""

import email
import json
import queue
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from fakes import mail_half
from fakes.faulty_mail import HELD, NONE, Fault, FaultyMail
from fakes.whole_robot import free_port

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

SEED = 20261121
MAILS = 200
AT_ONCE = 6
MOST_KILLS = 10  # of the link, in the middle of SMTP
ASKING_KILLS = 0.03  # probability of one more while it takes a mail in
SERVER_KILLS = (50, 100, 150)  # mails told of
PATIENCE = 200.0  # s for all
COMMANDS = ("CONNECT", "EHLO", "AUTH", "MAIL", "RCPT", "DATA", "CONTENT")
REPLIES = {
    "CONNECT": "421 4.3.2 too many connections",
    "AUTH": "535 5.7.8 wrong name or password",
    "MAIL": "451 4.3.0 try again later",
    "RCPT": "450 4.2.1 the mailbox is busy",
    "DATA": "452 4.3.1 no room",
    "CONTENT": "451 4.3.0 try again later",
}


class Chance:
    """Chooses a fault for each connection, and which of them kill the link when it has met them."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self.deadly: list[Fault] = []

    def fault(self) -> Fault:
        if self._random.random() < 0.4:
            return NONE
        at = self._random.choice(COMMANDS)
        seen = self._random.random() < 0.5
        kind = self._random.choices(["cut", "reply", "held", "deadly"], [5, 4, 1, 1])[0]
        if kind == "deadly" and len(self.deadly) < MOST_KILLS:
            self.deadly.append(Fault(at, HELD, seen))
            return self.deadly[-1]
        return Fault(at, {"reply": REPLIES.get(at, ""), "held": HELD}.get(kind, ""), seen)

    def kill_after(self) -> float | None:
        """Seconds from asking for a mail to the end of the link."""
        return self._random.uniform(0.0, 0.01) if self._random.random() < ASKING_KILLS else None


class Process:
    """A process with lines in and out."""

    def __init__(self, log: Path, *words: str) -> None:
        self.lines: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        with log.open("ab") as errors:
            self._process = subprocess.Popen(
                [sys.executable, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True
            )
        ready = threading.Event()
        self._reader = threading.Thread(target=self._read, args=(ready,), daemon=True)
        self._reader.start()
        assert ready.wait(30), log.read_text()

    def _read(self, ready: threading.Event) -> None:
        for line in self._process.stdout or ():
            if line.startswith("READY"):
                ready.set()
            elif line.endswith("\n"):
                self.lines.put(json.loads(line))

    def write(self, *words: Any) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(words) + "\n")
        self._process.stdin.flush()

    def end(self, number: int = signal.SIGTERM) -> None:
        self._process.send_signal(number)
        self._process.wait(10)
        self._reader.join(10)
        for end in (self._process.stdin, self._process.stdout):
            with suppress(BrokenPipeError):
                end.close()  # type: ignore[union-attr]


class Core:
    """Asks for mails as the core agent does: with one Message-ID each, and again when the link was lost before it has answered."""

    def __init__(self, start: Callable[[], Process], line: FaultyMail, chance: Chance, told: Callable[[int], None]) -> None:
        self.told: dict[str, str] = {}
        self.kills = 0
        self._start, self._line, self._chance, self._on_told = start, line, chance, told
        self._link = start()
        self._until = time.monotonic() + PATIENCE
        self._open: dict[str, str] = {}  # job: mail
        self._numbers = iter(range(10**6))
        self._met = 0

    def send_all(self, mails: list[str]) -> None:
        waiting = list(mails)
        while waiting or self._open:
            while waiting and len(self._open) < AT_ONCE:
                self._ask(waiting.pop(0))
                pause = self._chance.kill_after()
                if pause is not None:
                    time.sleep(pause)
                    self._kill()
            self._look()

    def wait_empty(self, outbox: Path) -> None:
        while list(outbox.glob("*/message.eml")):
            self._look()

    def close(self) -> None:
        self._link.end()

    def _ask(self, mail: str) -> None:
        job = f"job-{next(self._numbers)}"
        self._open[job] = mail
        fields = {"recipients": ["zofia@home.example"], "subject": mail, "body": "hello", "attachment": "", "message_id": mail}
        self._link.write(job, fields)

    def _look(self) -> None:
        """Take one event, and kill the link where it has met what kills it."""
        assert time.monotonic() < self._until, f"after {PATIENCE:g} s {len(self.told)} mails are told of, open: {self._open}"
        met = self._line.met[self._met :]
        self._met += len(met)
        if any(fault is deadly for fault in met for deadly in self._chance.deadly):
            self._kill()
        try:
            event = self._link.lines.get(timeout=0.01)
        except queue.Empty:
            return
        self._take(event)
        self._on_told(len(self.told))

    def _take(self, event: dict[str, Any]) -> None:
        assert event["kind"] == 1, event
        self.told[self._open.pop(event["job"])] = json.loads(event["result"])["state"]

    def _kill(self) -> None:
        self._link.end(signal.SIGKILL)
        self.kills += 1
        while not self._link.lines.empty():  # what it has said before its end was heard
            self._take(self._link.lines.get())
        self._link = self._start()
        lost, self._open = list(self._open.values()), {}
        for mail in lost:
            self._ask(mail)


class Server:
    """The mail server, which is killed and started again."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self._folder, self._kills = folder, list(SERVER_KILLS)
        self._process = self._start()

    def _start(self) -> Process:
        words = ["-m", "rapp_cloud.mail", "--port", str(self.port), "--maildir", str(self._folder / "mail")]
        return Process(self._folder / "mail.log", *words)

    def suffer(self, told: int) -> None:
        """Kill it when so many mails are told of."""
        if self._kills and told >= self._kills[0]:
            self._kills.pop(0)
            self._process.end(signal.SIGKILL)
            self._process = self._start()

    def end(self) -> None:
        self._process.end()


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    server = Server(tmp_path)
    yield server
    server.end()


@pytest.fixture
def line(server: Server) -> Iterator[FaultyMail]:
    line = FaultyMail(server.port, login=True)
    yield line
    line.close()


def test_no_mail_is_lost_and_none_comes_twice(line: FaultyMail, server: Server, tmp_path: Path) -> None:
    print(f"seed {SEED}")
    chance = Chance(SEED)
    line.choose = chance.fault
    words = [mail_half.__file__, str(tmp_path / "home"), str(line.port)]
    core = Core(lambda: Process(tmp_path / "link.log", *words), line, chance, server.suffer)
    begun = time.monotonic()
    try:
        mails = [f"<{number}@nao.rapp>" for number in range(MAILS)]
        core.send_all(mails)
        core.wait_empty(tmp_path / "home" / "link" / "outbox")
    finally:
        core.close()
    arrived = Counter(email.message_from_bytes(path.read_bytes())["Message-ID"] for path in (tmp_path / "mail" / "new").iterdir())
    said = Counter(core.told.values())
    faults = Counter(f"{fault.at} {fault.reply[:4] or 'cut'}{' seen' if fault.seen else ''}" for fault in line.met)
    print(f"{len(line.met)} faults, {core.kills} kills of the link, told {dict(said)}, {time.monotonic() - begun:.0f} s")
    print(", ".join(f"{name}: {count}" for name, count in sorted(faults.items())))
    assert arrived == dict.fromkeys(mails, 1)
    assert set(core.told) == set(mails)
    assert core.kills >= MOST_KILLS / 2
    assert said["kept"] and said["locked"] and said["delivered"]
