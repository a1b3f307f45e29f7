"""The commands of authors and store keepers, from words to exit status."""

import re
from pathlib import Path

import pytest

from fakes.packages import source_folder
from rapp_cli.__main__ import main
from rapp_cli.cloud import own_rapps
from rapp_cli.store.permissions import missing_permissions
from rapp_cloud.app import open_shelf
from rapp_cloud.memory import open_memory
from rapp_hop.hz.archive import build
from rapp_hop.hz.manifest import parse_manifest


class Desk:
    """Runs commands about one store."""

    def __init__(self, data: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.data = data
        self._capsys = capsys

    def does(self, *words: object) -> str:
        status = main([*map(str, words), "--data", str(self.data)])
        told = self._capsys.readouterr()
        assert status == 0, told.err
        return told.out

    def refuses(self, *words: object) -> str:
        status = main([*map(str, words), "--data", str(self.data)])
        told = self._capsys.readouterr()
        assert status in (1, 2) and told.err.startswith("rapp: cannot ")
        assert "Traceback" not in told.err
        return told.err


@pytest.fixture
def desk(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Desk:
    monkeypatch.chdir(tmp_path)
    open_shelf(tmp_path / "cloud").create()
    return Desk(tmp_path / "cloud", capsys)


@pytest.mark.parametrize("language", [[], ["--javascript"]])
def test_a_new_rapp_is_published_shown_and_yanked(desk: Desk, language: list[str]) -> None:
    assert main(["new", "my_first", *language]) == 0
    assert "can be published: my_first 1.0.0" in desk.does("publish", "my_first", "--check")
    assert "on offer: my_first 1.0.0" in desk.does("publish", "my_first")
    assert re.search(r"(?m)^my_first +1\.0\.0 +dynamic +rapp ", desk.does("store", "list"))
    shown = desk.does("store", "show", "my_first")
    for words in ("may use: rapp_say, profile", "keywords, en: my first", "publisher: rapp", "needs: nao, API >=1.0"):
        assert words in shown
    desk.does("store", "yank", "my_first", "1.0.0")
    assert desk.does("store", "list") == ""
    assert "yanked" in desk.does("store", "show", "my_first")
    assert "not on offer" in desk.refuses("store", "yank", "my_first", "1.0.0")
    assert "not in the store" in desk.refuses("store", "show", "nothing")


@pytest.mark.parametrize("name", ["My", "../x", "a-b", "9a", "", "stop"])
def test_names_that_cannot_be(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", name]) == 2
    assert list(tmp_path.iterdir()) == []


def test_new_never_writes_over_anything(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    assert main(["new", "mine", "--folder", str(tmp_path)]) == 2
    assert list((tmp_path / "mine").iterdir()) == []


def test_a_word_of_another_rapp_is_refused(desk: Desk, tmp_path: Path) -> None:
    desk.does("publish", source_folder(tmp_path))
    same = source_folder(tmp_path, "parrot", keywords={"en": ["hello"]})
    assert "'hello' (en) is what one says for hello" in desk.refuses("publish", same)
    assert "raise its version" in desk.refuses("publish", source_folder(tmp_path, version="0.9.0"))
    assert "there is no such publisher" in desk.refuses("publish", source_folder(tmp_path, "a"), "--publisher", "nobody")
    assert "no package.json" in desk.refuses("publish", tmp_path / "cloud")


def test_both_packages_of_a_four_agent_rapp(desk: Desk, tmp_path: Path) -> None:
    cloud = {"agent": "cloud", "keywords": {}, "sentences": {}, "permissions": {"core": [], "cloud": []}}
    source_folder(tmp_path, "mind_cloud", **cloud).rename(tmp_path / "c")
    source_folder(tmp_path, "mind", partner="mind_cloud").rename(tmp_path / "d")
    assert "publish its cloud agent mind_cloud 1.0.0 first" in desk.refuses("publish", tmp_path / "d")
    (tmp_path / "mind").mkdir()
    (tmp_path / "c").rename(tmp_path / "mind" / "cloud")
    (tmp_path / "d").rename(tmp_path / "mind" / "dynamic")
    told = desk.does("publish", tmp_path / "mind")
    assert [line.split()[2] for line in told.splitlines()] == ["mind_cloud", "mind"]


@pytest.mark.parametrize(
    ("program", "missing"),
    [
        ("from rapp_api import communication\ncommunication.text_to_speech('x')", []),
        ("from rapp_api import communication as c\nc.capture_audio(3)", ["rapp_record"]),
        ("from rapp_api.navigation import move_to\nmove_to(1, 0, 0)", ["rapp_move_to"]),
        ("from rapp_api import communication\ncommunication.rapp_record(3)", ["rapp_record"]),
        ("from rapp_api import cloud\ncloud.call_wait('weather')\ncloud.call_wait('profile')", ["cloud weather"]),
        ("from rapp_api import cloud\ncloud.send_mail_wait([], '', '')", ["cloud send_mail"]),
        ("from rapp_api import cloud\ncloud.call_agent_wait('mine')", []),
        ("class robot:\n    pass\nrobot.move_to()", []),
        ("this is no program", ["a program Python can read: agent.py"]),
    ],
)
def test_what_is_used_must_be_asked_for(desk: Desk, tmp_path: Path, program: str, missing: list[str]) -> None:
    folder = source_folder(tmp_path, program=program)
    assert missing_permissions(folder, parse_manifest((folder / "package.json").read_bytes())) == missing
    if missing:
        assert missing[0] in desk.refuses("publish", folder)


@pytest.mark.parametrize(
    ("program", "missing"),
    [
        ("communication.textToSpeech('x'); vision.captureImage();", ["rapp_capture_image"]),
        ("await navigation\n  .moveTo(1, 0, 0);", ["rapp_move_to"]),
        ("new ROSLIB.Service({ ros, name: '/rapp_rest', serviceType: 'rapp_msgs/Rest' });", ["rapp_rest"]),
        (
            "cloud.call('weather'); cloud.call(\"profile\"); cloud.callAgent('mine'); cloud.sendMail([]);",
            ["cloud send_mail", "cloud weather"],
        ),
        ("// communication.playAudio('x')\n/* navigation.rest(\n) */", []),
        ("robot.moveTo(1, 0, 0);", []),
    ],
)
def test_what_javascript_uses_must_be_asked_for(tmp_path: Path, program: str, missing: list[str]) -> None:
    folder = source_folder(tmp_path)
    (folder / "more.mjs").write_text(program)
    (folder / "node_modules" / "other").mkdir(parents=True)
    (folder / "node_modules" / "other" / "index.js").write_text("navigation.moveVel(1, 0, 0)")
    assert missing_permissions(folder, parse_manifest((folder / "package.json").read_bytes())) == missing


def test_the_rapps_of_the_repository_could_all_be_published(desk: Desk) -> None:
    for folder in sorted(own_rapps(), key=lambda folder: folder.name != "cloud"):
        assert "on offer" in desk.does("publish", folder)


def test_keys_from_the_terminal(desk: Desk) -> None:
    assert desk.does("keys", "new", "maria") == "maria may publish\n"
    before = desk.does("keys", "list")
    for name in ("root", "targets", "snapshot", "timestamp", "maria"):
        assert desk.does("keys", "rotate", name) == f"{name} has a new key\n"
    after = desk.does("keys", "list")
    ids = [set(re.findall(r"[0-9a-f]{64}", text)) for text in (before, after)]
    assert len(ids[0]) == len(ids[1]) == 6
    assert len(ids[0] & ids[1]) == 1
    assert desk.does("keys", "revoke", "maria") == "maria has no key any more\n"
    assert re.search(r"(?m)^maria +revoked", desk.does("keys", "list"))
    assert "rotate it" in desk.refuses("keys", "revoke", "root")
    assert not re.search(r"PRIVATE|passphrase", before + after)


def test_several_root_keys_from_the_terminal(desk: Desk) -> None:
    told = desk.does("keys", "root", "--keys", "3", "--threshold", "2")
    assert "2 must sign: root.pem, root_2.pem, root_3.pem" in told
    assert re.search(r"(?m)^root .* key here, 2 of 3 sign ", desk.does("keys", "list"))
    assert desk.does("keys", "rotate", "root") == "root has a new key\n"
    assert "cannot have 3 of 2 keys sign" in desk.refuses("keys", "root", "--keys", "2", "--threshold", "3")


def test_changes_of_keys_are_in_the_audit_log(desk: Desk) -> None:
    desk.does("keys", "new", "maria")
    desk.does("keys", "grant", "maria", "clock", "lamp")
    desk.refuses("keys", "rotate", "nobody")
    desk.does("keys", "rotate", "snapshot")
    desk.does("keys", "root", "--keys", "3", "--threshold", "2")
    desk.does("keys", "revoke", "maria")
    desk.does("keys", "resume")
    with open_memory(desk.data) as memory:
        entries = memory.audit.entries()
    assert [(entry.deed, entry.subject) for entry in entries] == [
        ("keys new", "maria"), ("keys grant", "maria"), ("keys rotate", "snapshot"), ("keys root", "root"),
        ("keys revoke", "maria"), ("keys resume", "root"),
    ]  # fmt: skip
    assert entries[1].detail == {"rapp": ["clock", "lamp"]}
    assert all(entry.who.endswith(" at the platform") for entry in entries)


def test_nothing_changes_while_the_audit_log_is_away(desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.does("publish", source_folder(tmp_path))
    before = desk.does("store", "show", "hello"), desk.does("keys", "list")
    monkeypatch.setenv("RAPP_CLOUD_DATABASE", f"postgresql://rapp@/rapp?host={tmp_path}")
    for words in (
        ("publish", source_folder(tmp_path, version="1.1.0")), ("store", "yank", "hello", "1.0.0"), ("keys", "new", "maria"),
        ("keys", "revoke", "rapp"),
    ):  # fmt: skip
        assert "cannot use the database now" in desk.refuses(*words)
    assert (desk.does("store", "show", "hello"), desk.does("keys", "list")) == before


def test_packages_as_files(desk: Desk, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = source_folder(tmp_path)
    for output in ("a.hz", "b.hz"):
        assert main(["hz", "build", str(folder), "-o", output]) == 0
    assert (tmp_path / "a.hz").read_bytes() == (tmp_path / "b.hz").read_bytes() == build(folder)
    assert main(["hz", "inspect", "a.hz"]) == 0
    assert "hello/etc/weblet.info" in capsys.readouterr().out
    signed = desk.does("hz", "sign", "a.hz")
    keyid = signed.split()[-1]
    assert "hello 1.0.0, signed by" in desk.does("hz", "verify", "a.hz")
    assert "signed by" in desk.does("hz", "verify", "a.hz", "--key", keyid)
    assert "nobody has vouched for" in desk.refuses("hz", "verify", "a.hz", "--key", "0" * 64)
    desk.does("keys", "rotate", "rapp")
    assert "nobody has vouched for" in desk.refuses("hz", "verify", "a.hz")
    (tmp_path / "b.hz").write_bytes(build(source_folder(tmp_path / "x", program="evil()\n")))
    assert "does not match" in desk.refuses("hz", "verify", "b.hz", "--key", keyid, "--signature", "a.hz.sig")
    (tmp_path / "b.hz").write_bytes(b"<html>")
    assert main(["hz", "inspect", "b.hz"]) == 2
    assert main(["hz", "inspect", "nothing.hz"]) == 1
    assert main(["hz", "build", str(tmp_path / "nowhere")]) == 1


def test_without_a_store(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["store", "list", "--home", str(tmp_path)]) == 2
    assert "./rapp up makes one" in capsys.readouterr().err
