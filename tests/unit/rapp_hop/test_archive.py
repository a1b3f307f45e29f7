"""Packages: the same bytes every time, and every hostile one refused (P01 … P25 of the list of bad inputs)."""

import gzip
import io
import json
import os
import shutil
import tarfile
import zlib
from pathlib import Path

import pytest

from fakes.packages import file_member, folder_member, manifest, packed, right_members, source_folder, tar_bytes
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


def test_what_is_built_comes_out_again(tmp_path: Path) -> None:
    source = source_folder(tmp_path)
    (source / "sounds" / "deep").mkdir(parents=True)
    (source / "sounds" / "deep" / ("long" * 15 + ".ogg")).write_bytes(bytes(range(256)) * 1000)
    (source / "tool.sh").write_text("#!/bin/sh\n")
    (source / "tool.sh").chmod(0o755)
    contents = extract(io.BytesIO(build(source)), tmp_path / "out")
    assert contents.manifest.name == "hello"
    names = {path.relative_to(source) for path in source.rglob("*")}
    assert {path.relative_to(tmp_path / "out") for path in (tmp_path / "out").rglob("*")} == names
    for name in names:
        if (source / name).is_file():
            assert (tmp_path / "out" / name).read_bytes() == (source / name).read_bytes()
    assert (tmp_path / "out" / "tool.sh").stat().st_mode & 0o100
    assert not (tmp_path / "out" / "agent.py").stat().st_mode & 0o111


def test_other_tools_can_read_and_write_packages(tmp_path: Path) -> None:
    source = source_folder(tmp_path)
    with tarfile.open(fileobj=io.BytesIO(build(source)), mode="r:gz") as tar:
        assert tar.getnames() == ["hello", "hello/agent.py", "hello/package.json"]
    for tar_format in (tarfile.USTAR_FORMAT, tarfile.GNU_FORMAT):
        assert inspect(packed(right_members(), tar_format)).manifest.name == "hello"


def test_build_refuses_links_and_wrong_sources(tmp_path: Path) -> None:
    source = source_folder(tmp_path)
    (source / "secret").symlink_to("/etc/passwd")
    with pytest.raises(Invalid, match="neither a file nor a folder"):
        build(source)
    with pytest.raises(Refused, match="cannot build"):
        build(tmp_path / "nowhere")


@pytest.mark.parametrize(
    "name",
    ["hello/../../x", "../x", "/etc/x", "a/../../x", "hello/./x", "hello//x", "..\\x", "hello/C:x", "hello/x/..", "hello/ x"],
    ids=["P01", "P01b", "P02", "P03", "dot", "empty", "P04", "P04drive", "end", "space"],
)
def test_p01_to_p04_paths_out_of_the_package(tmp_path: Path, name: str) -> None:
    refuse(with_member(file_member(name)), tmp_path, "cannot unpack")


def test_p05_nul_and_control_signs(tmp_path: Path) -> None:
    refuse(with_member(file_member("hello/a\nb")), tmp_path, "control or invisible")
    block = bytearray(tar_bytes(with_nul := [*right_members(), file_member("hello/aXb")]))
    place = block.index(b"hello/aXb")
    block[place + 7] = 0
    start = place
    total = sum(block[start : start + 148]) + 8 * 32 + sum(block[start + 156 : start + 512])
    block[start + 148 : start + 156] = b"%06o\0 " % total
    assert len(with_nul) == 4
    refuse(io.BytesIO(gzip.compress(bytes(block))), tmp_path, "NUL")


def test_p06_long_and_deep_names(tmp_path: Path) -> None:
    refuse(with_member(file_member("hello/" + "a/" * 10 + "x")), tmp_path, "deeper than 5")
    refuse(packed([*right_members(), file_member("hello/" + "n" * 5000)], tarfile.GNU_FORMAT), tmp_path, "type b'L'")
    refuse(with_member(file_member("hello/" + "é" * 45)), tmp_path, "longer than 80", Limits(name=80))


@pytest.mark.parametrize(
    ("kind", "label"),
    [(tarfile.SYMTYPE, "2"), (tarfile.LNKTYPE, "1"), (tarfile.CHRTYPE, "3"), (tarfile.BLKTYPE, "4"), (tarfile.FIFOTYPE, "6"),
     (tarfile.GNUTYPE_SPARSE, "S"), (b"7", "7"), (b"Z", "Z")],
    ids=["P07", "P09", "P11char", "P11block", "P11fifo", "P19", "contiguous", "unknown"],
)  # fmt: skip
def test_p07_to_p11_links_devices_sparse(tmp_path: Path, kind: bytes, label: str) -> None:
    refuse(with_member(file_member("hello/x", b"", type=kind, linkname="/etc/passwd")), tmp_path, f"type b'{label}'")


def test_p08_p10_a_file_written_through_a_link(tmp_path: Path) -> None:
    link = file_member("hello/dir", b"", type=tarfile.SYMTYPE, linkname="..")
    refuse(with_member(link, file_member("hello/dir/evil")), tmp_path, "type b'2'")


@pytest.mark.parametrize("bit", [0o4755, 0o2755, 0o1755])
def test_p12_special_bits(tmp_path: Path, bit: int) -> None:
    refuse(with_member(file_member("hello/x", mode=bit)), tmp_path, "setuid")


def test_p12_p13_modes_and_owners_are_ours(tmp_path: Path) -> None:
    extract(with_member(file_member("hello/x", mode=0o777, uid=12345, gid=12345)), tmp_path / "out")
    status = (tmp_path / "out" / "x").stat()
    assert status.st_mode & 0o022 == 0
    assert (status.st_uid, status.st_gid) == (os.getuid(), os.getgid())


def test_p14_the_same_name_twice(tmp_path: Path) -> None:
    refuse(with_member(file_member("hello/agent.py", b"evil")), tmp_path, "comes twice")
    refuse(with_member(file_member("hello/agent.py/x")), tmp_path, "a file and a folder")


def test_p15_p16_twins_and_hidden_signs(tmp_path: Path) -> None:
    refuse(with_member(file_member("hello/Agent.py")), tmp_path, "differ only in their spelling")
    refuse(with_member(file_member("hello/D/x"), file_member("hello/d/y")), tmp_path, "differ only")
    refuse(with_member(file_member("hello/ﬁ"), file_member("hello/fi")), tmp_path, "differ only")
    refuse(with_member(file_member("hello/e\u0301")), tmp_path, "Unicode form C")
    refuse(with_member(file_member("hello/\u202egpj.exe")), tmp_path, "invisible")


def test_names_that_are_not_utf8(tmp_path: Path) -> None:
    refuse(with_member(file_member("hello/\udcff")), tmp_path, "not UTF-8")


def test_p17_gzip_bomb(tmp_path: Path) -> None:
    bomb = packed([*right_members(), file_member("hello/zeros", bytes(2_000_000))])
    assert len(bomb.getvalue()) < 20_000
    refuse(bomb, tmp_path, "larger than")
    assert sum(path.stat().st_size for path in (tmp_path / "out").rglob("*")) < SMALL.unpacked


def test_p17_bomb_after_the_end_of_the_tar(tmp_path: Path) -> None:
    refuse(io.BytesIO(gzip.compress(tar_bytes(right_members()) + bytes(2_000_000))), tmp_path, "larger than")


def test_p18_many_tiny_files(tmp_path: Path) -> None:
    refuse(with_member(*(file_member(f"hello/{n}") for n in range(30))), tmp_path, "more than 20")


def test_p20_cut_off_anywhere(tmp_path: Path) -> None:
    whole = packed(right_members()).getvalue()
    for place in range(0, len(whole) - 1, 7):
        with pytest.raises(Invalid, match="cannot unpack"):
            inspect(io.BytesIO(whole[:place]))


def test_p20_more_after_the_end(tmp_path: Path) -> None:
    whole = packed(right_members()).getvalue()
    refuse(io.BytesIO(whole + b"x"), tmp_path, "after the end of the gzip")
    refuse(io.BytesIO(whole + whole), tmp_path, "after the end of the gzip")
    refuse(io.BytesIO(gzip.compress(tar_bytes(right_members()) + b"x")), tmp_path, "after the end of the tar")


def test_every_flipped_byte_of_the_data_is_noticed(tmp_path: Path) -> None:
    whole = packed(right_members()).getvalue()
    for place in range(10, len(whole), 11):
        broken = bytearray(whole)
        broken[place] ^= 0x55
        with pytest.raises(Invalid):
            inspect(io.BytesIO(bytes(broken)))


def test_p21_pax_headers_and_negative_sizes(tmp_path: Path) -> None:
    info, data = file_member("hello/x")
    info.pax_headers = {"size": "-1"}
    refuse(packed([*right_members(), (info, data)], tarfile.PAX_FORMAT), tmp_path, "type b'x'")
    refuse(packed([*right_members(), file_member("hello/x", b"", size=-5)], tarfile.GNU_FORMAT), tmp_path, "not octal")


def test_p19_a_size_beyond_the_end(tmp_path: Path) -> None:
    refuse(with_member(file_member("hello/x", b"", size=8 * 1024**3 - 1)), tmp_path, "cut off")


@pytest.mark.parametrize("data", [b"", b"<html>404</html>", gzip.compress(b"no tar" * 200), zlib.compress(b"x" * 600)])
def test_p22_not_a_tar(tmp_path: Path, data: bytes) -> None:
    refuse(io.BytesIO(data), tmp_path, "cannot unpack")


def test_p23_empty(tmp_path: Path) -> None:
    refuse(packed([]), tmp_path, "empty")


def test_p24_manifest_missing_or_huge(tmp_path: Path) -> None:
    refuse(packed([folder_member("hello"), file_member("hello/agent.py")]), tmp_path, "has no hello/package.json")
    huge = file_member("hello/package.json", b" " * 300_000)
    refuse(packed([folder_member("hello"), huge]), tmp_path, "larger than", Limits())


def test_p25_another_name_than_the_folder(tmp_path: Path) -> None:
    other = file_member("hello/package.json", json.dumps(manifest("parrot")).encode())
    refuse(packed([other, file_member("hello/agent.py")]), tmp_path, "top folder is 'hello'")


def test_p27_entry_not_in_the_package(tmp_path: Path) -> None:
    refuse(packed(right_members()[:2]), tmp_path, "entry 'agent.py' is not a file")


def test_two_top_folders_or_none(tmp_path: Path) -> None:
    refuse(with_member(file_member("other/x")), tmp_path, "more than one top folder")
    refuse(packed([file_member("package.json", json.dumps(manifest()).encode())]), tmp_path, "outside the top folder")


def test_an_old_folder_is_not_unpacked_into(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with pytest.raises(FileExistsError):
        extract(packed(right_members()), tmp_path / "out")
