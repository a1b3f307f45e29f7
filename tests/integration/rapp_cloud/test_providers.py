"""Providers elsewhere (deliverable §1.2) and a real platform over TLS: a RApp comes from an author's desk to a robot."""

import asyncio
import copy
import hashlib
import io
import os
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import TargetFile

from fakes.cloud_process import CloudProcess, cloud_process
from fakes.packages import source_folder
from fakes.provider import Provider, certificate_of, make_tls
from fakes.publisher import Publisher
from rapp_cloud.app import open_shelf
from rapp_cloud.memory import open_memory
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Invalid, Refused
from rapp_hop.hz.archive import build, inspect
from rapp_hop.hz.delivery import Delivery
from rapp_hop.hz.manifest import Manifest
from rapp_hop.hz.standing import signed

PATIENCE = 30.0  # s
Capsys = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def cloud(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CloudProcess]:
    folder = tmp_path_factory.mktemp("providers")
    with cloud_process(folder, [source_folder(folder)], publisher_quota=1, **make_tls(folder)) as cloud:
        yield cloud


@pytest.fixture
def someone(cloud: CloudProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Provider]:
    return lambda name: Provider(name, cloud, tmp_path, monkeypatch)


def rapp(folder: Path, name: str, version: str = "1.0.0", program: str = "pass\n", **more: Any) -> str:
    words = {"keywords": {"en": [name]}, "sentences": {"en": [f"start {name}"]}, **more}
    return str(source_folder(folder / program.strip(), name, version, program, **words))


def as_robot(cloud: CloudProcess, work: Callable[[HopClient], Awaitable[Any]]) -> Any:
    """Do something as the platform's robot."""

    async def connected() -> Any:
        token = (cloud.data / "robots/nao.token").read_text()
        client = HopClient(f"https://127.0.0.1:{cloud.port}", token, ca_file=certificate_of(cloud))
        try:
            await client.call("register", {"kind": "nao", "api_version": "1.0"})
            return await work(client)
        finally:
            await client.close()

    return asyncio.run(connected())


def installed(cloud: CloudProcess, home: Path, name: str) -> str:
    """Install as a robot's link does; gives the version."""
    root = (cloud.data / "root.json").read_bytes()
    return str(as_robot(cloud, lambda client: Delivery(client, root, home).install(name)).version)


def listed(cloud: CloudProcess) -> dict[str, str]:
    found = as_robot(cloud, lambda client: client.call("list_rapps"))
    return {entry["name"]: entry["version"] for entry in found["rapps"]}


def page(cloud: CloudProcess) -> str:
    pieces: list[bytes] = []
    as_robot(cloud, lambda client: client.download("/store", pieces.append, 2**20))
    return b"".join(pieces).decode()


def files(cloud: CloudProcess) -> set[str]:
    return {path.name for path in (cloud.data / "tuf").rglob("*") if path.suffix in (".json", ".hz")} - {"timestamp.json"}


def test_from_an_authors_desk_to_a_robot(
    cloud: CloudProcess, someone: Callable[[str], Provider], capsys: Capsys, tmp_path: Path
) -> None:
    maria = someone("maria")
    assert maria.run(capsys, "new", "clock", "--folder", str(tmp_path)) == 0
    source = str(tmp_path / "clock")
    assert maria.far(capsys, "publish", source) == 1 and "token" in maria.err  # there is none yet
    data = ("cloud", "--data", str(cloud.data))
    assert maria.run(capsys, *data, "token", "maria", str(maria.token)) == 1 and not maria.token.exists()  # nobody of that name yet
    assert maria.run(capsys, *data, "account", "maria", "--role", "publisher", given="correct horse\n") == 0, maria.err
    assert maria.run(capsys, *data, "token", "maria", str(maria.token)) == 0, maria.err
    maria.wait_until_known()
    assert maria.far(capsys, "publish", source) == 2 and "./rapp keys own" in maria.err
    assert maria.run(capsys, "keys", "own", "maria", "--home", str(maria.home), "-o", str(maria.file)) == 0
    assert "./rapp keys new maria --public maria.publisher" in maria.out
    assert maria.far(capsys, "publish", source) == 1 and "./rapp keys new maria --public FILE" in maria.err
    assert maria.owner(capsys, "keys", "new", "maria", "--public", str(maria.file)) == 0
    assert maria.far(capsys, "publish", source) == 1 and "./rapp keys grant maria" in maria.err
    assert maria.owner(capsys, "keys", "grant", "maria", "lamp") == 0
    assert maria.far(capsys, "publish", source) == 1 and "./rapp keys grant maria clock" in maria.err
    assert maria.owner(capsys, "keys", "grant", "maria", "clock") == 0
    assert maria.far(capsys, "publish", source, "--check") == 0 and "can be published: clock 1.0.0" in maria.out
    assert "every minute" not in maria.err and "clock" not in listed(cloud)
    assert maria.far(capsys, "publish", source) == 0 and "on offer: clock 1.0.0" in maria.out
    assert "robots look at what is on offer every minute" in maria.err
    assert listed(cloud)["clock"] == "1.0.0"
    assert '<article id="clock">' in page(cloud) and "<dt>Signed by</dt><dd>maria</dd>" in page(cloud)
    assert installed(cloud, tmp_path / "robot", "clock") == "1.0.0"
    assert maria.far(capsys, "publish", source) == 0  # the same again changes nothing
    assert not (cloud.data / "keys" / "maria.pem").exists()
    assert b"BEGIN ENCRYPTED" in (maria.home / "publisher/keys/maria.pem").read_bytes()


def test_versions_come_and_go(cloud: CloudProcess, someone: Callable[[str], Provider], capsys: Capsys, tmp_path: Path) -> None:
    anna = someone("anna")
    anna.join(capsys, "post")
    for version in ("1.0.0", "1.1.0"):
        assert anna.far(capsys, "publish", rapp(tmp_path, "post", version)) == 0, anna.err
    assert anna.far(capsys, "store", "list") == 0
    lines = [line.split()[:3] for line in anna.out.splitlines()]
    assert ["post", "1.0.0", "anna"] in lines and ["hello", "1.0.0", "rapp"] in lines
    assert anna.far(capsys, "store", "yank", "post", "1.1.0") == 0
    assert anna.far(capsys, "store", "yank", "hello", "1.0.0") == 1 and "anna has none on offer" in anna.err
    assert anna.far(capsys, "store", "renew") == 0 and "the list of anna is good until 20" in anna.out
    assert anna.far(capsys, "store", "show", "post") == 0
    assert "publisher: anna" in anna.out and "keywords, en: post" in anna.out
    assert [line.split()[0] for line in anna.out.splitlines()[-2:]] == ["1.0.0", "1.1.0"]
    assert anna.out.rstrip().endswith("1.1.0        yanked")
    assert anna.far(capsys, "store", "show", "nothing") == 2
    assert anna.far(capsys, "publish", rapp(tmp_path, "post", "1.1.0", "evil()\n")) == 1 and "other bytes" in anna.err
    assert listed(cloud)["post"] == "1.0.0"
    with open_memory(cloud.data) as memory:
        deeds = [(entry.deed, entry.subject) for entry in memory.audit.entries(1000) if entry.who == "anna"]
        assert memory.audit.check()
    assert deeds == [("publish", "post 1.0.0"), ("publish", "post 1.1.0"), ("yank", "post 1.1.0"), ("renew", "list 5")]


def test_both_packages_of_a_four_agent_rapp(
    cloud: CloudProcess, someone: Callable[[str], Provider], capsys: Capsys, tmp_path: Path
) -> None:
    karl = someone("karl")
    karl.join(capsys, "kitchen")
    own = {"agent": "cloud", "keywords": {}, "sentences": {}, "permissions": {"core": [], "cloud": []}}
    Path(rapp(tmp_path, "kitchen_cloud", **own)).rename(tmp_path / "cloud")
    Path(rapp(tmp_path, "kitchen", partner="kitchen_cloud")).rename(tmp_path / "dynamic")
    assert karl.far(capsys, "publish", str(tmp_path)) == 1 and "./rapp keys grant karl kitchen_cloud" in karl.err
    assert karl.owner(capsys, "keys", "grant", "karl", "kitchen_cloud") == 0
    assert karl.far(capsys, "publish", str(tmp_path), "--check") == 0, karl.err
    assert "can be published: kitchen_cloud 1.0.0" in karl.out and "before kitchen_cloud is on offer: kitchen 1.0.0" in karl.out
    assert karl.owner(capsys, "publish", str(tmp_path), "--check") == 0 and "can be published: kitchen 1.0.0" in karl.out
    assert karl.far(capsys, "publish", str(tmp_path)) == 0, karl.err
    assert [line.split(",")[0] for line in karl.out.splitlines()] == ["on offer: kitchen_cloud 1.0.0", "on offer: kitchen 1.0.0"]
    assert listed(cloud)["kitchen"] == "1.0.0" and "kitchen_cloud" not in listed(cloud)


def test_a_new_key_at_home(cloud: CloudProcess, someone: Callable[[str], Provider], capsys: Capsys, tmp_path: Path) -> None:
    nina = someone("nina")
    nina.join(capsys, "note")
    assert nina.far(capsys, "publish", rapp(tmp_path, "note")) == 0, nina.err
    assert nina.far(capsys, "keys", "own", "nina", "-o", str(nina.file)) == 0, nina.err
    assert nina.far(capsys, "publish", rapp(tmp_path, "note", "1.1.0")) == 0, nina.err  # the old key still counts
    assert nina.owner(capsys, "keys", "rotate", "nina", "--public", str(nina.file)) == 1
    assert "run it again" in nina.err  # its list is too old by now
    assert nina.far(capsys, "keys", "own", "nina", "-o", str(nina.file)) == 0, nina.err
    assert nina.far(capsys, "keys", "own", "nina", "-o", str(tmp_path / "later.publisher")) == 0, nina.err
    assert nina.owner(capsys, "keys", "rotate", "nina", "--public", str(nina.file)) == 0, nina.err  # the file before
    assert nina.far(capsys, "publish", rapp(tmp_path, "note", "1.2.0")) == 0, nina.err
    assert installed(cloud, tmp_path / "robot", "note") == "1.2.0"
    assert nina.owner(capsys, "keys", "revoke", "nina") == 0
    source = rapp(tmp_path, "note", "1.3.0")
    assert nina.far(capsys, "publish", source) == 1 and "the store knows no key" in nina.err
    assert "note" not in listed(cloud)
    words = ("keys", "own", "nina", "--home", str(nina.home), "-o", str(nina.file), "--anew")
    assert nina.run(capsys, *words, "--after", "-1") == 2 and "cannot follow list -1" in nina.err
    assert nina.run(capsys, *words) == 0
    assert nina.owner(capsys, "keys", "new", "nina", "--public", str(nina.file)) == 1 and "--after 5" in nina.err
    assert nina.run(capsys, *words, "--after", "5") == 0
    assert nina.run(capsys, *words, "-o", str(tmp_path / "later.publisher"), "--after", "5") == 0
    assert nina.owner(capsys, "keys", "new", "nina", "--public", str(nina.file)) == 0, nina.err
    assert nina.far(capsys, "publish", source) == 0, nina.err
    assert installed(cloud, tmp_path / "robot", "note") == "1.3.0"


def test_what_is_wrong_at_home_is_said_there(
    cloud: CloudProcess, someone: Callable[[str], Provider], capsys: Capsys, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    otto = someone("otto")
    otto.join(capsys, "oven")
    before = files(cloud)
    greedy = "from rapp_api import navigation\nnavigation.rest()\n"
    assert otto.far(capsys, "publish", rapp(tmp_path / "a", "oven", program=greedy)) == 2 and "rapp_rest" in otto.err
    assert otto.far(capsys, "publish", rapp(tmp_path / "b", "oven", keywords={"en": ["hello"]})) == 1
    assert "is what one says for hello" in otto.err
    assert (
        otto.far(capsys, "publish", rapp(tmp_path / "c", "oven"), "--publisher", "rapp") == 2 and "keys here are otto" in otto.err
    )
    otto.token.chmod(0o644)
    assert otto.far(capsys, "publish", rapp(tmp_path / "d", "oven")) == 2 and "0600" in otto.err
    otto.token.chmod(0o600)
    assert otto.run(capsys, "publish", rapp(tmp_path / "e", "oven"), "--cloud", "http://cloud.example") == 2
    nonsense, source = tmp_path / "nonsense", rapp(tmp_path / "n", "oven")
    nonsense.write_bytes(b"\xff nonsense")
    nonsense.chmod(0o600)
    right = {name: os.environ[name] for name in ("RAPP_ROOT_FILE", "RAPP_CLOUD_CA_FILE")}
    for name, file in right.items():
        monkeypatch.setenv(name, str(nonsense))
        assert otto.far(capsys, "publish", source) == 2 and name in otto.err
        monkeypatch.setenv(name, file)
    kept, otto.token = otto.token, nonsense
    assert otto.far(capsys, "publish", source) == 2 and "it holds no token" in otto.err
    otto.token = kept
    monkeypatch.delenv("RAPP_ROOT_FILE")
    assert otto.far(capsys, "publish", rapp(tmp_path / "f", "oven")) == 2 and "RAPP_ROOT_FILE" in otto.err
    other = tmp_path / "other.json"
    other.write_bytes((cloud.data / "root.json").read_bytes().replace(b'"sig":"', b'"sig":"00', 1))
    monkeypatch.setenv("RAPP_ROOT_FILE", str(other))
    assert otto.far(capsys, "publish", rapp(tmp_path / "g", "oven")) == 2 and "cannot trust the store" in otto.err
    assert otto.owner(capsys, "store", "renew") == 2 and "--cloud" in otto.err
    assert otto.owner(capsys, "keys", "new", "paula", "--public", str(otto.file)) == 2 and "is otto's" in otto.err
    assert files(cloud) == before
    assert otto.token.read_text() not in cloud.log.read_text()


def until(error: type[HopError], status: int, call: Callable[[], object]) -> None:
    """Call until the platform has seen what was changed beside it."""
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            call()
            found = "no error"
        except HopError as wrong:
            if isinstance(wrong, error) and wrong.status == status:
                return
            found = str(wrong)
        assert time.monotonic() < deadline, found
        time.sleep(0.1)


def call(cloud: CloudProcess, token: str, service: str, arguments: dict[str, Any]) -> Any:
    async def connected() -> Any:
        client = HopClient(f"https://127.0.0.1:{cloud.port}", token, ca_file=certificate_of(cloud))
        try:
            return await client.call(service, arguments, timeout=PATIENCE)
        finally:
            await client.close()

    return asyncio.run(connected())


def test_who_may_not(cloud: CloudProcess, someone: Callable[[str], Provider], capsys: Capsys, tmp_path: Path) -> None:
    """Tokens of the wrong kind, and those that were taken back; the judge's own refusals are in tests/unit."""
    rosa = someone("rosa")
    rosa.join(capsys, "rose")
    assert rosa.far(capsys, "publish", rapp(tmp_path, "rose")) == 0, rosa.err
    small, large = tmp_path / "small", tmp_path / "large"
    small.write_bytes(b"{}")
    with large.open("wb") as file:
        file.truncate(80 * 2**20)
    robot = (cloud.data / "robots/nao.token").read_text()
    read_only = rosa.give_token("read")
    for token in (robot, read_only):
        until(Refused, 403, lambda token=token: call(cloud, token, "publish_list", {"signed_list": small}))  # type: ignore[misc]
    right = rosa.give_token()
    until(Refused, 403, lambda: call(cloud, right, "publish_list", {"signed_list": anothers(tmp_path, rosa)}))
    with pytest.raises(HopError) as caught:
        call(cloud, right, "publish_package", {"package": large, "signed_list": small})
    assert caught.value.status == 413
    assert rosa.far(capsys, "publish", rapp(tmp_path, "rose", "2.0.0", "#" + "x" * 10)) == 0, rosa.err
    before = files(cloud)
    heavy = Path(rapp(tmp_path, "rose", "3.0.0", "'heavy'\n"))
    (heavy / "noise").write_bytes(noise(2**20))
    assert rosa.far(capsys, "publish", str(heavy)) == 1 and "1048576 are allowed" in rosa.err
    assert rosa.run(capsys, "cloud", "--data", str(cloud.data), "revoke", "rosa") == 0 and "3 revoked" in rosa.out
    until(Refused, 401, lambda: call(cloud, right, "publish_list", {"signed_list": small}))
    assert rosa.far(capsys, "publish", rapp(tmp_path, "rose", "4.0.0", "'late'\n")) == 1 and "RAPP_TOKEN_FILE" in rosa.err
    assert files(cloud) == before


def test_what_a_forger_hands_in_changes_nothing(
    cloud: CloudProcess, someone: Callable[[str], Provider], capsys: Capsys, tmp_path: Path
) -> None:
    shelf = open_shelf(cloud.data)
    eve, vera = (Publisher(name, shelf, tmp_path) for name in ("eve", "vera"))
    eve.join("echo")
    vera.join("violin")
    tokens = {one.name: someone(one.name).give_token() for one in (eve, vera)}
    data, other = (build(Path(rapp(tmp_path, "echo", version, "'echo'\n"))) for version in ("1.0.0", "1.1.0"))
    violin = build(Path(rapp(tmp_path, "violin")))
    older = eve.signed(eve.standing.renewed())

    def hand_in(who: Publisher, package: bytes, signed_list: bytes) -> None:
        (tmp_path / "list").write_bytes(signed_list)
        files = {"package": who.file(package), "signed_list": tmp_path / "list"}
        call(cloud, tokens[who.name], "publish_package", files)

    hand_in(vera, violin, vera.list_with(violin))
    hand_in(eve, data, eve.list_with(data))
    before, right = files(cloud), eve.standing.with_package(manifest_of(other), other)
    assert right is not None
    wrong, gone, named = (copy.deepcopy(right) for _ in range(3))
    wrong.targets["echo-1.1.0.hz"].hashes["sha256"] = "0" * 64
    del gone.targets["echo-1.0.0.hz"]
    named.targets["violin-2.0.0.hz"] = TargetFile.from_data("violin-2.0.0.hz", violin, ["sha256"])
    named.targets["violin-2.0.0.hz"].unrecognized_fields["custom"] = {"name": "violin", "version": "2.0.0"}
    del named.targets["echo-1.1.0.hz"]
    stranger = CryptoSigner.generate_ed25519()
    for text, who, package, signed_list in (
        ("the name is not theirs", eve, violin, eve.signed(named)),
        ("not signed by vera's key", vera, other, eve.signed(right)),
        ("not signed by eve's key", eve, violin, vera.signed(vera.standing.without("violin", "1.0.0"))),
        ("echo-1.0.0.hz is gone", eve, other, eve.signed(gone)),
        ("somebody published meanwhile; run it again", eve, other, older),
        ("another length or hash", eve, other, eve.signed(wrong)),
        ("another length or hash", eve, build(Path(rapp(tmp_path, "echo", "1.1.0", "'evil'\n"))), eve.signed(right)),
        ("not signed by eve's key", eve, other, signed(right, stranger)),
        ("cannot read JSON", eve, other, b"no list"),
    ):
        with pytest.raises(HopError, match=text) as caught:
            hand_in(who, package, signed_list)
        assert isinstance(caught.value, Refused | Invalid)
        assert files(cloud) == before
    shelf.custody.revoke("eve")
    with pytest.raises(Refused, match="knows no key of theirs"):
        hand_in(eve, other, eve.signed(right))
    hand_in(vera, build(Path(rapp(tmp_path, "violin", "1.1.0"))), vera.list_with(build(tmp_path / "pass" / "violin-1.1.0")))
    assert installed(cloud, tmp_path / "robot", "violin") == "1.1.0"


def test_of_two_at_once_one_is_told_to_run_it_again(
    cloud: CloudProcess, someone: Callable[[str], Provider], tmp_path: Path
) -> None:
    both = Publisher("both", open_shelf(cloud.data), tmp_path)
    both.join("bell", "buzzer")
    token = someone("both").give_token()
    calls = []
    for name in ("bell", "buzzer"):
        package, signed_list = tmp_path / name, tmp_path / f"{name}.list"
        package.write_bytes(build(Path(rapp(tmp_path, name, program=f"'{name}'\n"))))
        signed_list.write_bytes(both.list_with(package.read_bytes()))
        calls.append({"package": package, "signed_list": signed_list})

    async def at_once() -> list[Any]:
        client = HopClient(f"https://127.0.0.1:{cloud.port}", token, ca_file=certificate_of(cloud))
        try:
            return await asyncio.gather(*(client.call("publish_package", one) for one in calls), return_exceptions=True)
        finally:
            await client.close()

    found = asyncio.run(at_once())
    (refused,) = [one for one in found if isinstance(one, HopError)]
    assert isinstance(refused, Refused) and "somebody published meanwhile; run it again" in str(refused)
    (done,) = [one for one in found if one is not refused]
    assert [name for name in ("bell", "buzzer") if name in listed(cloud)] == [done["name"]]


def manifest_of(package: bytes) -> Manifest:
    return inspect(io.BytesIO(package)).manifest


def anothers(folder: Path, whose: Provider) -> Path:
    """The list of another publisher as it lies in the store."""
    path = folder / "anothers"
    path.write_bytes(next((whose.home / "publisher" / "seen").glob("*/targets.json")).read_bytes())
    return path


def noise(count: int) -> bytes:
    """Bytes that no packer makes smaller, always the same."""
    return b"".join(hashlib.sha256(str(number).encode()).digest() for number in range(count // 32 + 1))
