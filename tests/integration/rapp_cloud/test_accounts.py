"""Accounts, tokens, codes and passwords, on both databases; and at the platform's port."""

import asyncio
import hashlib
import io
import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from fakes.cloud_process import CloudProcess, cloud_process
from fakes.packages import source_folder
from rapp_cli.__main__ import main as rapp
from rapp_cli.home.agents import environment
from rapp_cli.home.place import Home, Settings
from rapp_cli.home.ports import USUAL
from rapp_cloud.accounts import Accounts
from rapp_cloud.admission import LOGIN, Admission
from rapp_cloud.database import tables
from rapp_cloud.database.engine import Database
from rapp_cloud.memory import open_memory
from rapp_cloud.quotas import DAY, Quotas
from rapp_cloud.turnstile import BURST, Turnstile
from rapp_cloud.witness import operator
from rapp_hop.client import HopClient
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.hz.delivery import Delivery
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import TURNED_AWAY, WireAnswer, WireRequest

ROOT = b"{}"
PATIENCE = 30.0  # s


class Clock:
    now = 1_700_000_000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def accounts(database: Database, clock: Clock) -> Accounts:
    return Accounts(database, clock)


@pytest.fixture
def admission(accounts: Accounts) -> Admission:
    return Admission(accounts)


def test_a_code_lets_one_robot_in_once(admission: Admission, accounts: Accounts) -> None:
    code = admission.invite("nao", 60, ROOT)
    assert code.endswith("-" + hashlib.sha256(ROOT).hexdigest()[:32])
    robot, token = admission.join(code)
    assert (robot, accounts.name_of(token)) == ("nao", "nao")
    for again in (code, "x", "", code[1:]):
        with pytest.raises(Refused, match="wrong, used or too old"):
            admission.join(again)
    assert accounts.name_of(token) == "nao"


def test_a_code_ends(admission: Admission, clock: Clock) -> None:
    code = admission.invite("nao", 60, ROOT)
    clock.now += 60
    with pytest.raises(Refused, match="too old"):
        admission.join(code)


def test_neither_codes_nor_passwords_are_kept(admission: Admission, database: Database) -> None:
    code = admission.invite("nao", 60, ROOT)
    admission.enrol("maria", "user", "correct horse")
    with database.reading() as connection:
        kept = str([connection.execute(sa.select(table)).all() for table in tables.metadata.sorted_tables])
    assert code.partition("-")[0] not in kept
    assert "correct horse" not in kept
    assert "$argon2id$" in kept


def test_a_password_gives_a_token_that_ends(admission: Admission, accounts: Accounts, clock: Clock) -> None:
    admission.enrol("maria", "publisher", "correct horse")
    token = admission.log_in("maria", "correct horse")
    holder = accounts.holder(token)
    assert holder is not None
    assert (holder.name, holder.scopes) == ("maria", {"read", "publish"})
    for name, password in (("maria", "wrong horse"), ("nobody", "correct horse"), ("maria", ""), ("maria", "correct horse ")):
        with pytest.raises(Refused, match="name or password is wrong"):
            admission.log_in(name, password)
    clock.now += LOGIN
    assert accounts.holder(token) is None


def test_passwords_change_and_names_belong_to_one_role(admission: Admission) -> None:
    admission.enrol("maria", "user", "correct horse")
    admission.enrol("maria", "user", "another horse")
    with pytest.raises(Refused):
        admission.log_in("maria", "correct horse")
    admission.log_in("maria", "another horse")
    with pytest.raises(Refused, match="choose another name"):
        admission.invite("maria", 60, ROOT)
    with pytest.raises(Refused, match="10 to 200"):
        admission.enrol("eve", "user", "short")
    admission.invite("nao", 60, ROOT)
    with pytest.raises(Refused, match="name or password"):
        admission.log_in("nao", "")


def test_tokens_are_revoked_alone_or_all_of_one(accounts: Accounts) -> None:
    tokens = [accounts.add_robot("nao") for _ in range(3)]
    other = accounts.add_robot("other")
    first = accounts.holder(tokens[0])
    assert first is not None
    assert accounts.revoke(first.token) == 1
    assert [accounts.name_of(token) for token in (*tokens, other)] == [None, "nao", "nao", "other"]
    assert accounts.revoke("nao") == 2
    assert [holder.name for holder in accounts.list()] == ["other"]
    assert accounts.revoke("nao") == accounts.revoke("") == accounts.revoke("0") == 0


def test_no_token_has_more_than_its_role(accounts: Accounts) -> None:
    accounts.add_robot("nao")
    with pytest.raises(Refused, match="may have robot"):
        accounts.give("nao", ["publish"])
    with pytest.raises(Refused, match="no such account"):
        accounts.give("nobody")


@pytest.mark.parametrize("zone", ["Europe/Berlin", "America/St_Johns", "UTC"])
def test_o07_a_change_to_winter_time_moves_no_end(accounts: Accounts, clock: Clock, zone: str) -> None:
    before = os.environ.get("TZ")
    os.environ["TZ"] = zone
    time.tzset()
    try:
        clock.now = 1_698_535_800.0  # half an hour before Europe's clocks go back
        accounts.add_robot("nao")
        token = accounts.give("nao", life=3600)
        clock.now += 3599
        assert accounts.name_of(token) == "nao"
        clock.now += 1
        assert accounts.name_of(token) is None
    finally:
        del os.environ["TZ"]
        if before is not None:
            os.environ["TZ"] = before
        time.tzset()


def test_scopes_rates_and_quotas(accounts: Accounts, clock: Clock) -> None:
    monotonic = [0.0]
    turnstile = Turnstile(accounts, Quotas(accounts.database, clock), lambda: monotonic[0])
    accounts.add_robot("nao")
    accounts.open("maria", "user")
    reader, slow, few = accounts.give("maria"), accounts.give("nao", rate=2.0), accounts.give("nao", quota=3)
    turnstile.admit(None, "register")
    turnstile.admit("a door's secret, not ours", "register")
    turnstile.admit(reader, "openapi")
    with pytest.raises(Refused, match="the token's scope is read"):
        turnstile.admit(reader, "register")
    for _ in range(2):
        turnstile.admit(slow, "heartbeat")
    with pytest.raises(Unreachable, match="2 calls per second") as caught:
        turnstile.admit(slow, "heartbeat")
    assert (caught.value.status, caught.value.retry_after) == (429, 1)
    monotonic[0] += 1
    turnstile.admit(slow, "heartbeat")
    for _ in range(3):
        turnstile.admit(few, "heartbeat")
    with pytest.raises(Unreachable, match="3 calls a day") as caught:
        turnstile.admit(few, "heartbeat")
    assert caught.value.retry_after == int(DAY - clock.now % DAY) + 1
    clock.now += caught.value.retry_after
    turnstile.admit(few, "heartbeat")


class Gate:
    """A mount that everybody may fetch from, its visits counted on a clock that stands still."""

    def __init__(self, turnstile: Turnstile) -> None:
        async def answer(_visit: Visit) -> WireAnswer:
            return WireAnswer(200, "text/plain", b"")

        self._mount = turnstile.counted(Mount("/tuf/targets/", answer, public=True))

    def lets_in(self, rest: str = "1.root.json", address: str = "192.0.2.1", token: str = "", **more: str) -> int:
        """Visit a thousand times; gives how often it was answered."""
        headers = {**({"accept-token": token} if token else {}), **more}
        visit = Visit("", rest, WireRequest("GET", self._mount.prefix + rest, headers, b""), address)

        async def visits() -> int:
            answers = await asyncio.gather(*(self._mount.handler(visit) for _ in range(1000)), return_exceptions=True)
            refused = [each for each in answers if isinstance(each, BaseException)]
            assert {(type(each), each.status, each.reason) for each in refused} <= {(Unreachable, 429, TURNED_AWAY)}
            return 1000 - len(refused)

        return asyncio.run(visits())


def test_who_has_no_name_at_the_platform_has_a_number_in_its_log(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os, "getuid", lambda: 2**31 - 7)
    assert operator() == "account 2147483641 at the platform"


def test_what_everybody_may_fetch_has_its_bounds_too(accounts: Accounts, clock: Clock) -> None:
    gate = Gate(Turnstile(accounts, Quotas(accounts.database, clock), lambda: 0.0))
    accounts.add_robot("nao")
    free, slow, few = accounts.give("nao"), accounts.give("nao", rate=1.0), accounts.give("nao", quota=3)
    assert gate.lets_in() == gate.lets_in(address="192.0.2.2") == BURST
    assert gate.lets_in() == gate.lets_in(token="nobody's" * 4) == 0
    assert gate.lets_in(token=free) == BURST, "a robot is not its address"
    assert gate.lets_in(address="127.0.0.1") == gate.lets_in(address="127.0.0.1", token=free) == 1000
    assert gate.lets_in(address="127.0.0.1", forwarded="for=192.0.2.3") == BURST
    assert gate.lets_in(address="127.0.0.1", token=slow) == BURST
    assert gate.lets_in(address="127.0.0.1", token=few) == 1000, "lists are no calls"
    assert gate.lets_in("0.hello-1.0.0.hz", "127.0.0.1", few) == 3, "packages are"
    assert gate.lets_in("download", "127.0.0.1", few) == 0


@pytest.fixture(scope="module")
def cloud(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CloudProcess]:
    folder = tmp_path_factory.mktemp("accounts")
    with cloud_process(folder, [source_folder(folder)]) as cloud:
        yield cloud


def _command(cloud: CloudProcess, *words: str, given: str = "") -> str:
    whole = [sys.executable, "-m", "rapp_cloud", words[0], "--data", str(cloud.data), *words[1:]]
    done = subprocess.run(whole, input=given, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def _post(cloud: CloudProcess, path: str, value: object, token: str = "") -> tuple[int, Any, str]:
    """Status, answer, Retry-After."""
    headers = {"Content-Type": "application/json", **({"Accept-Token": token} if token else {})}
    request = urllib.request.Request(f"http://127.0.0.1:{cloud.port}{path}", json.dumps(value).encode(), headers)
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            return answer.status, json.load(answer), ""
    except urllib.error.HTTPError as error:
        with error:
            return error.code, json.load(error), error.headers.get("Retry-After", "")


def _fetch(cloud: CloudProcess, path: str, token: str) -> int:
    """Status."""
    request = urllib.request.Request(f"http://127.0.0.1:{cloud.port}{path}", headers={"Accept-Token": token})
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        with error:
            return int(error.code)


def _seen(cloud: CloudProcess, token: str, status: int) -> tuple[int, Any, str]:
    """Ask until the platform has seen what a command has changed."""
    deadline = time.monotonic() + PATIENCE
    while (found := _post(cloud, "/hop/available_services", {}, token))[0] != status:
        assert time.monotonic() < deadline, found
        time.sleep(0.1)
    return found


def test_packages_count_to_a_day_s_calls(cloud: CloudProcess, tmp_path: Path) -> None:
    _command(cloud, "token", "nao", str(tmp_path / "few"), "--quota", "3")
    token = (tmp_path / "few").read_text()
    _seen(cloud, token, 200)
    package = next(path.name for path in (cloud.data / "tuf/targets").iterdir())
    assert {_fetch(cloud, path, token) for path in ("/store", "/tuf/metadata/1.root.json", "/hop/weblets/synclist")} == {200}
    assert [_fetch(cloud, f"/tuf/targets/{package}", token) for _ in range(3)] == [200, 200, 429]
    assert _fetch(cloud, "/hop/weblets/download?weblet=hello-1.0.0.hz", token) == 429


def test_a_robot_joins_and_works_and_is_thrown_out(cloud: CloudProcess) -> None:
    code = _command(cloud, "invite", "r2")
    status, answer, _ = _post(cloud, "/join", {"code": code})
    assert (status, answer["robot"]) == (200, "r2")
    token = answer["token"]
    assert _post(cloud, "/hop/register", {"kind": "nao", "api_version": "1.0"}, token)[0] == 200
    assert _post(cloud, "/join", {"code": code})[0] == 401
    listed = next(line for line in _command(cloud, "tokens").splitlines() if " r2 " in line)
    assert _command(cloud, "revoke", listed.split()[0]) == "1 revoked"
    _seen(cloud, token, 401)
    assert token not in cloud.log.read_text()


def test_rapp_join_brings_token_and_root(
    cloud: CloudProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    url, code = f"http://127.0.0.1:{cloud.port}", _command(cloud, "invite", "r3")
    words = ["join", url, "--home", str(tmp_path / "home")]
    monkeypatch.setattr("sys.stdin", io.StringIO(code[:-1] + ("0" if code[-1] != "0" else "1")))
    assert rapp(words) == 2
    assert "cannot trust this platform" in capsys.readouterr().err
    monkeypatch.setattr("sys.stdin", io.StringIO(code + "\n"))
    assert rapp(words) == 0
    joined = tmp_path / "home" / "joined"
    token = (joined / "token").read_text()
    assert (joined / "token").stat().st_mode & 0o777 == 0o600
    assert (joined / "root.json").read_bytes() == (cloud.data / "root.json").read_bytes()
    assert _post(cloud, "/hop/register", {"kind": "nao", "api_version": "1.0"}, token)[0] == 200
    monkeypatch.setattr("sys.stdin", io.StringIO(code))
    assert rapp(words) == 1
    settings = Settings("r3", None, url, None, (), dict(USUAL))
    found = environment(Home(tmp_path / "home"), settings, {})
    assert (found["RAPP_CLOUD"], found["RAPP_TOKEN_FILE"]) == (url, str(joined / "token"))


@pytest.mark.parametrize("value", [{}, [], {"code": 3}, {"code": "x", "more": 1}, "x"])
def test_a_wrong_word_at_the_door_is_named(cloud: CloudProcess, value: object) -> None:
    status, answer, _ = _post(cloud, "/join", value)
    assert (status, answer["error"]["kind"]) == (400, "invalid")


def test_scope_rate_and_quota_at_the_port(cloud: CloudProcess, tmp_path: Path) -> None:
    _command(cloud, "account", "maria", given="correct horse\n")
    status, answer, _ = _post(cloud, "/login", {"name": "maria", "password": "correct horse"})
    assert status == 200
    assert _post(cloud, "/hop/register", {"kind": "nao", "api_version": "1.0"}, answer["token"])[0] == 403
    _command(cloud, "token", "nao", str(tmp_path / "few"), "--quota", "2", "--days", "1")
    few = (tmp_path / "few").read_text()
    assert (tmp_path / "few").stat().st_mode & 0o777 == 0o600
    _seen(cloud, few, 200)
    _post(cloud, "/hop/heartbeat", {}, few)
    status, answer, later = _post(cloud, "/hop/heartbeat", {}, few)
    assert (status, answer["error"]["kind"]) == (429, "unreachable")
    assert "2 calls a day" in answer["error"]["message"]
    assert 0 < int(later) <= DAY + 1


def test_who_guesses_is_slowed_down(cloud: CloudProcess) -> None:
    answers = [_post(cloud, "/login", {"name": "eve", "password": "x"}) for _ in range(25)]
    assert {answer[0] for answer in answers} == {401, 429}
    assert all(later == "1" for status, _, later in answers if status == 429)


def test_o10_who_published_installed_and_ran_what(cloud: CloudProcess, tmp_path: Path) -> None:
    async def robot(nao: HopClient, _other: HopClient) -> None:
        await Delivery(nao, (cloud.data / "root.json").read_bytes(), tmp_path / "robot").install("hello")
        await nao.call("report", {"run": {"run": "r-1", "rapp": "hello", "version": "1.0.0", "outcome": "done"}})

    cloud.run(robot)
    deadline = time.monotonic() + PATIENCE
    while True:
        with open_memory(cloud.data) as memory:
            deeds = [(entry.who, entry.deed, entry.subject) for entry in memory.audit.entries()]
            if ("nao", "run", "hello") in deeds:
                break
        assert time.monotonic() < deadline, deeds
        time.sleep(0.1)
    assert ("rapp", "publish", "hello 1.0.0") in deeds
    assert any(who == "nao" and deed == "download" and subject.endswith("hello-1.0.0.hz") for who, deed, subject in deeds)
    shown = _command(cloud, "audit")
    assert "hello 1.0.0" in shown
    assert _command(cloud, "audit", "--check").endswith("all as they were written")
