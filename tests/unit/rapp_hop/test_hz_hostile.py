"""P01 to P30 of the list of hostile packages, one test each: refused, nothing written outside the target, nothing left."""

import gzip
import io
import json
import os
import tarfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import file_member, folder_member, manifest, packed, right_members, tar_bytes
from rapp_cloud.catalogue import RobotKind, catalogue
from rapp_cloud.publishing import check_publication
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.archive import extract, inspect
from rapp_hop.hz.install import PackageFile, RappFolder, install
from rapp_hop.hz.manifest import parse_manifest, reasons_against
from rapp_hop.hz.tar import Limits

SMALL = Limits(packed=100_000, unpacked=200_000, members=20, depth=5, name=100)
Package = io.BytesIO | bytes


class Robot:
    """A folder to unpack into, with something precious beside it and above it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.target = folder / "rapps" / "target"
        self.target.parent.mkdir()
        (folder / "precious").write_text("precious")
        (folder / "rapps" / "x").write_text("precious")
        self._before = self._seen()

    def _seen(self) -> dict[str, tuple[int, int, bytes]]:
        """Everything that is there, with modes, times and bytes; folders' times tell of what came and went."""
        found = {}
        for path in self._folder.rglob("*"):
            status = path.lstat()
            found[str(path)] = (status.st_mode, 0 if path.is_dir() else status.st_mtime_ns, _bytes(path))
        return found

    def refuses(self, package: Package, match: str, limits: Limits = SMALL) -> None:
        data = package if isinstance(package, bytes) else package.getvalue()
        with pytest.raises(Invalid, match=match):
            extract(io.BytesIO(data), self.target, limits)
        assert self._seen() == self._before
        with pytest.raises(Invalid, match=match):
            inspect(io.BytesIO(data), limits)

    def refuses_with(self, *members: tuple[tarfile.TarInfo, bytes], match: str) -> None:
        """A right package but for these members at its end."""
        self.refuses(packed([*right_members(), *members]), match)


def _bytes(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() and not path.is_symlink() else b""


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Robot]:
    yield Robot(tmp_path)
    assert not Path("/tmp/evil").exists()


def with_manifest(data: bytes) -> io.BytesIO:
    return packed([folder_member("hello"), file_member("hello/package.json", data), file_member("hello/agent.py")])


def changed(**rapp: Any) -> io.BytesIO:
    return with_manifest(json.dumps(manifest(**rapp)).encode())


def test_p01_dot_dot(robot: Robot) -> None:
    robot.refuses_with(file_member("../x"), match="not a plain path")
    robot.refuses_with(file_member("hello/../../x"), match="not a plain path")
    robot.refuses_with(file_member("hello/x/.."), match="not a plain path")


def test_p02_absolute_path(robot: Robot) -> None:
    robot.refuses_with(file_member("/tmp/evil"), match="cannot unpack")


def test_p03_up_through_a_folder(robot: Robot) -> None:
    robot.refuses_with(file_member("a/../../x"), match="not a plain path")


@pytest.mark.parametrize("name", ["..\\x", "hello\\..\\..\\x", "hello/C:x", "C:/x"])
def test_p04_backslash_and_drive_letter(robot: Robot, name: str) -> None:
    robot.refuses_with(file_member(name), match="cannot unpack")


def test_p05_nul_and_control_signs(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/a\nb"), match="control or invisible")
    robot.refuses_with(file_member("hello/a\x1b[2Jb"), match="control or invisible")
    block = bytearray(tar_bytes([*right_members(), file_member("hello/aXb")]))
    place = block.index(b"hello/aXb")
    block[place + 7] = 0
    total = sum(block[place : place + 148]) + 8 * 32 + sum(block[place + 156 : place + 512])
    block[place + 148 : place + 156] = b"%06o\0 " % total
    robot.refuses(gzip.compress(bytes(block)), "NUL")


def test_p06_long_and_deep_names(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/" + "a/" * 10 + "x"), match="deeper than 5")
    robot.refuses(packed([*right_members(), file_member("hello/" + "n" * 5000)], tarfile.GNU_FORMAT), "type b'L'")
    robot.refuses(packed([*right_members(), file_member("d/" * 500 + "x")], tarfile.GNU_FORMAT), "type b'L'")
    robot.refuses(packed([*right_members(), file_member("hello/" + "é" * 45)]), "longer than 80", Limits(name=80))


def test_p07_link_out_of_the_tree(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/x", b"", type=tarfile.SYMTYPE, linkname="/etc/passwd"), match="type b'2'")


def test_p08_file_written_through_a_link(robot: Robot) -> None:
    link = file_member("hello/dir", b"", type=tarfile.SYMTYPE, linkname="../..")
    robot.refuses_with(link, file_member("hello/dir/precious", b"evil"), match="type b'2'")


def test_p09_hard_link_to_an_outside_file(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/x", b"", type=tarfile.LNKTYPE, linkname="../../precious"), match="type b'1'")


def test_p10_hard_link_to_a_deeper_link(robot: Robot) -> None:
    link = file_member("hello/a/b/link", b"", type=tarfile.SYMTYPE, linkname="../../../../precious")
    hard = file_member("hello/x", b"", type=tarfile.LNKTYPE, linkname="hello/a/b/link")
    robot.refuses_with(link, hard, match="type b'2'")
    robot.refuses_with(hard, link, match="type b'1'")


@pytest.mark.parametrize("kind", [tarfile.CHRTYPE, tarfile.BLKTYPE, tarfile.FIFOTYPE, tarfile.CONTTYPE, b"Z"])
def test_p11_devices_and_fifos(robot: Robot, kind: bytes) -> None:
    robot.refuses_with(file_member("hello/x", b"", type=kind), match="only files and folders")


def test_p12_special_and_world_writable_bits(robot: Robot) -> None:
    for bit in (0o4755, 0o2755, 0o1755):
        robot.refuses_with(file_member("hello/x", mode=bit), match="setuid")
    extract(packed([*right_members(), file_member("hello/x", mode=0o777)]), robot.target)
    assert (robot.target / "x").stat().st_mode & 0o022 == 0


def test_p13_owner_root(robot: Robot) -> None:
    extract(packed([*right_members(), file_member("hello/x", uid=0, gid=0), file_member("hello/y", uid=4321)]), robot.target)
    for name in ("x", "y"):
        status = (robot.target / name).stat()
        assert (status.st_uid, status.st_gid) == (os.getuid(), os.getgid())


def test_p14_the_same_name_twice(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/agent.py", b"evil"), match="comes twice")
    robot.refuses_with(file_member("hello/agent.py/x"), match="a file and a folder")


def test_p15_names_that_differ_in_case(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/Agent.py"), match="differ only in their spelling")
    robot.refuses_with(file_member("hello/D/x"), file_member("hello/d/y"), match="differ only")


def test_p16_twins_and_hidden_signs(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/ﬁ"), file_member("hello/fi"), match="differ only")
    robot.refuses_with(file_member("hello/e\u0301"), match="Unicode form C")
    robot.refuses_with(file_member("hello/\u202egpj.exe"), match="invisible")
    for name in ("hel\u202elo", "héllo", "he\u0301llo", "hello\n"):
        whole = json.dumps(manifest(name)).encode()
        robot.refuses(with_manifest(whole), "cannot use the name")


def test_p17_gzip_bomb(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/zeros", bytes(2_000_000)), match="larger than")
    robot.refuses(gzip.compress(tar_bytes(right_members()) + bytes(2_000_000)), "larger than")


def test_p18_many_tiny_files(robot: Robot) -> None:
    robot.refuses_with(*(file_member(f"hello/{n}", b"") for n in range(30)), match="more than 20")
    many = packed([*right_members(), *(file_member(f"hello/{n}", b"") for n in range(Limits().members))])
    robot.refuses(many, "more than 2000 files", Limits())


def test_p19_sparse_files_and_sizes_that_lie(robot: Robot) -> None:
    robot.refuses_with(file_member("hello/x", b"", type=tarfile.GNUTYPE_SPARSE), match="type b'S'")
    robot.refuses_with(file_member("hello/x", b"", size=8 * 1024**3 - 1), match="cut off")


def test_p20_cut_off_and_more_after_the_end(robot: Robot) -> None:
    whole = packed(right_members()).getvalue()
    for place in range(0, len(whole) - 1, 7):
        robot.refuses(whole[:place], "cannot unpack")
    robot.refuses(whole + b"x", "after the end of the gzip")
    robot.refuses(whole + whole, "after the end of the gzip")
    robot.refuses(gzip.compress(tar_bytes(right_members()) + b"x"), "after the end of the tar")


def test_p21_pax_headers_negative_sizes_and_far_times(robot: Robot) -> None:
    for field, value in (("size", "-1"), ("size", "9" * 30), ("path", "/tmp/evil")):
        info, data = file_member("hello/x")
        info.pax_headers = {field: value}
        robot.refuses(packed([*right_members(), (info, data)], tarfile.PAX_FORMAT), "type b'x'")
    robot.refuses(packed([*right_members(), file_member("hello/x", b"", size=-5)], tarfile.GNU_FORMAT), "not octal")
    extract(packed([*right_members(), file_member("hello/x", mtime=0o77777777777)]), robot.target)
    assert (robot.target / "x").stat().st_mtime < 4e9


@pytest.mark.parametrize("data", [b"", b"<html>404</html>", gzip.compress(b"no tar" * 200, mtime=0), zlib.compress(b"x" * 600)])
def test_p22_not_a_tar(robot: Robot, data: bytes) -> None:
    robot.refuses(data, "cannot unpack")


def test_p23_empty(robot: Robot) -> None:
    robot.refuses(packed([]), "empty")


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"no json", "cannot read JSON"),
        (b"[1]", "must be an object"),
        (b'{"a":' * 100_000, "larger than 262144"),
        (b" " * 300_000, "larger than 262144"),
        (b'{"a":' * 50 + b"1" + b"}" * 50, "nested deeper"),
        (b'{"name":"a","name":"b"}', "'name' stands twice"),
        (b'{"x": NaN}', "NaN"),
        (b'{"x": Infinity}', "Infinity"),
    ],
)
def test_p24_manifests_that_are_none(robot: Robot, data: bytes, match: str) -> None:
    robot.refuses(with_manifest(data), match, Limits())


def test_p24_manifest_missing(robot: Robot) -> None:
    robot.refuses(packed([folder_member("hello"), file_member("hello/agent.py")]), "has no hello/package.json")


def test_p25_another_name_than_the_one_asked_for(robot: Robot, tmp_path: Path) -> None:
    other = file_member("hello/package.json", json.dumps(manifest("parrot")).encode())
    robot.refuses(packed([other, file_member("hello/agent.py")]), "top folder is 'hello'")
    path = tmp_path / "parrot-1.0.0.hz"
    path.write_bytes(packed(right_members()).getvalue())
    folder = RappFolder(tmp_path / "robot")
    with pytest.raises(Invalid, match=r"cannot install parrot 1\.0\.0: the package says it is hello"):
        install(PackageFile(path, "parrot", "1.0.0", SMALL), folder)
    assert [entry.name for entry in folder.root.iterdir()] == [".lock"]


@pytest.mark.parametrize(
    "version", ["1.0 ", "01.0.0", "1.0.0\n", "-1.0.0", "1.0." + "9" * 40, "1.0.0-", "1.0.0-01", "", "١.0.0", "v1.0.0"]
)
def test_p26_versions(robot: Robot, version: str) -> None:
    robot.refuses(changed(version=version), "cannot use version")


@pytest.mark.parametrize("entry", ["../agent.py", "/bin/sh", "a/../../x", "./agent.py", "a//b", "a\\b"])
def test_p27_entry_outside(robot: Robot, entry: str) -> None:
    robot.refuses(changed(entry=entry), "cannot use the entry")


def test_p27_entry_not_in_the_package(robot: Robot) -> None:
    robot.refuses(packed(right_members()[:2]), "entry 'agent.py' is not a file")
    robot.refuses(packed([*right_members()[:2], folder_member("hello/agent.py")]), "entry 'agent.py' is not a file")


@pytest.mark.parametrize("core", [["*"], ["rapp_everything"], ["/core_agent/rapp_say"], ["rapp_say*"]])
def test_p28_unknown_permissions_and_all_of_them(robot: Robot, core: list[str]) -> None:
    robot.refuses(changed(permissions={"core": core}), "cannot grant")
    robot.refuses(changed(permissions={"cloud": ["*"]}), "no wildcards")


def test_p29_dynamic_and_cloud_agent_of_other_versions() -> None:
    dynamic = parse_manifest(json.dumps(manifest(version="2.0.0", partner="hello_cloud")).encode())
    words: dict[str, Any] = {"agent": "cloud", "keywords": {}, "sentences": {}, "permissions": {"core": [], "cloud": []}}
    cloud = parse_manifest(json.dumps(manifest("hello_cloud", "1.0.0", **words)).encode())
    (entry,) = catalogue([dynamic, cloud], RobotKind("nao", "1.0"))
    assert entry.reasons == ("its cloud agent hello_cloud 2.0.0 is not in the store",)
    with pytest.raises(Refused, match=r"publish its cloud agent hello_cloud 2\.0\.0 first"):
        check_publication(dynamic, [cloud])


def test_p30_robots_it_is_not_for() -> None:
    found = parse_manifest(json.dumps(manifest(needs={"robot": ["pepper"], "api": ">=2.0"})).encode())
    assert reasons_against(found, "nao", "1.0") == [
        "it needs a robot of kind pepper, this is nao",
        "it needs API >=2.0, this robot has 1.0",
    ]
