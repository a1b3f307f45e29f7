"""Packages: the same bytes every time, and what is no right package refused (the hostile ones: test_hz_hostile.py)."""

import io
import json
import os
import shutil
import tarfile
from pathlib import Path

import pytest

from fakes.packages import file_member, manifest, packed, right_members, source_folder
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.archive import build, extract, inspect
from rapp_hop.hz.tar import Limits

SMALL = Limits(packed=100_000, unpacked=200_000, members=20, depth=5, name=100)


def refuse(package: io.BytesIO, tmp_path: Path, match: str, limits: Limits = SMALL) -> None:
    """Refused, and nothing outside the destination touched."""
    shutil.rmtree(tmp_path / "out", ignore_errors=True)
    before = sorted(path.name for path in tmp_path.iterdir())
    with pytest.raises(Invalid, match=match):
        extract(package, tmp_path / "out", limits)
    assert sorted(path.name for path in tmp_path.iterdir() if path.name != "out") == before
    package.seek(0)
    with pytest.raises(Invalid, match=match):
        inspect(package, limits)


def with_member(*members: tuple[tarfile.TarInfo, bytes]) -> io.BytesIO:
    return packed([*right_members(), *members])


def test_build_gives_the_same_bytes_whatever_times_and_modes(tmp_path: Path) -> None:
    one, two = source_folder(tmp_path / "a"), source_folder(tmp_path / "b")
    os.utime(two / "agent.py", (1, 1))
    (two / "agent.py").chmod(0o664)
    (two / "__pycache__").mkdir()
    (two / "__pycache__" / "agent.pyc").write_bytes(b"x")
    (two / ".hidden").write_text("x")
    assert build(one) == build(two)


def test_build_gives_bytes_that_no_machine_changes(tmp_path: Path) -> None:
    packed_bytes = build(source_folder(tmp_path))
    assert packed_bytes[4:8] == bytes(4)  # no time in the gzip header
    with tarfile.open(fileobj=io.BytesIO(packed_bytes), mode="r:gz") as tar:
        for member in tar.getmembers():
            assert (member.mtime, member.uid, member.gid, member.uname, member.gname) == (0, 0, 0, "", "")
        assert tar.getnames() == sorted(tar.getnames())


def test_what_was_unpacked_is_built_into_the_same_bytes(tmp_path: Path) -> None:
    once = build(source_folder(tmp_path))
    extract(io.BytesIO(once), tmp_path / "out")
    (tmp_path / "out" / "etc" / "weblet.info").write_text("((name lie))")
    assert build(tmp_path / "out") == once


def test_hop_s_own_description_is_in_every_package(tmp_path: Path) -> None:
    contents = extract(io.BytesIO(build(source_folder(tmp_path))), tmp_path / "out")
    assert contents.for_hop
    text = (tmp_path / "out" / "etc" / "weblet.info").read_text()
    assert text.startswith('((name "hello") (version "1.0.0") ')
    assert not inspect(packed(right_members())).for_hop


def test_what_is_built_comes_out_again(tmp_path: Path) -> None:
    source = source_folder(tmp_path)
    (source / "sounds" / "deep").mkdir(parents=True)
    (source / "sounds" / "deep" / ("long" * 15 + ".ogg")).write_bytes(bytes(range(256)) * 1000)
    (source / "tool.sh").write_text("#!/bin/sh\n")
    (source / "tool.sh").chmod(0o755)
    contents = extract(io.BytesIO(build(source)), tmp_path / "out")
    assert contents.manifest.name == "hello"
    names = {path.relative_to(source) for path in source.rglob("*")}
    names_for_hop = {Path("etc"), Path("etc/weblet.info")}
    assert {path.relative_to(tmp_path / "out") for path in (tmp_path / "out").rglob("*")} == names | names_for_hop
    for name in names:
        if (source / name).is_file():
            assert (tmp_path / "out" / name).read_bytes() == (source / name).read_bytes()
    assert (tmp_path / "out" / "tool.sh").stat().st_mode & 0o100
    assert not (tmp_path / "out" / "agent.py").stat().st_mode & 0o111


def test_other_tools_can_read_and_write_packages(tmp_path: Path) -> None:
    source = source_folder(tmp_path)
    with tarfile.open(fileobj=io.BytesIO(build(source)), mode="r:gz") as tar:
        assert tar.getnames() == ["hello", "hello/agent.py", "hello/etc", "hello/etc/weblet.info", "hello/package.json"]
    for tar_format in (tarfile.USTAR_FORMAT, tarfile.GNU_FORMAT):
        assert inspect(packed(right_members(), tar_format)).manifest.name == "hello"


def test_build_refuses_links_and_wrong_sources(tmp_path: Path) -> None:
    source = source_folder(tmp_path)
    (source / "secret").symlink_to("/etc/passwd")
    with pytest.raises(Invalid, match="neither a file nor a folder"):
        build(source)
    with pytest.raises(Refused, match="cannot build"):
        build(tmp_path / "nowhere")


def test_names_that_are_not_utf8(tmp_path: Path) -> None:
    refuse(with_member(file_member("hello/\udcff")), tmp_path, "not UTF-8")


def test_every_flipped_byte_of_the_data_is_noticed(tmp_path: Path) -> None:
    whole = packed(right_members()).getvalue()
    for place in range(10, len(whole), 11):
        broken = bytearray(whole)
        broken[place] ^= 0x55
        with pytest.raises(Invalid):
            inspect(io.BytesIO(bytes(broken)))


def test_two_top_folders_or_none(tmp_path: Path) -> None:
    refuse(with_member(file_member("other/x")), tmp_path, "more than one top folder")
    refuse(packed([file_member("package.json", json.dumps(manifest()).encode())]), tmp_path, "outside the top folder")


def test_an_old_folder_is_not_unpacked_into(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with pytest.raises(FileExistsError):
        extract(packed(right_members()), tmp_path / "out")
