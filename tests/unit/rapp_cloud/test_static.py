"""Files of the store: there, not there, and there but out of reach just now, which is another thing."""

import asyncio
import errno
import os
import resource
from pathlib import Path
from unittest.mock import Mock

import pytest

from rapp_cloud import __main__ as command
from rapp_cloud.static import store_files
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.mounts import Visit
from rapp_hop.protocol import OpenFile, WireRequest, status_of


def ask(folder: Path, name: str) -> bytes:
    request = WireRequest("GET", f"/tuf/metadata/{name}", {}, b"")
    answer = asyncio.run(store_files("/tuf/metadata/", folder).handler(Visit("", name, request, "127.0.0.1")))
    assert answer.status == 200 and isinstance(answer.body, OpenFile)
    with answer.body.file as file:
        return file.read()


def test_a_file_that_is_there(tmp_path: Path) -> None:
    (tmp_path / "1.root.json").write_bytes(b"{}")
    assert ask(tmp_path, "1.root.json") == b"{}"


@pytest.mark.parametrize("name", ["2.root.json", "folder", "loop", ".hidden", "a/b"])
def test_what_is_no_file_is_not_found(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(Refused) as caught:
        ask(tmp_path, name)
    assert status_of(caught.value) == 404


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENFILE, errno.EIO, errno.EACCES, errno.ENOMEM])
def test_a_file_that_cannot_be_opened_now_is_not_called_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    monkeypatch.setattr(Path, "open", Mock(side_effect=OSError(number, os.strerror(number))))
    with pytest.raises(Unreachable, match=os.strerror(number)) as caught:
        ask(tmp_path, "2.root.json")
    assert status_of(caught.value) == 503


def test_a_platform_may_open_as_many_files_as_the_system_lets_it() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(soft, 512), hard))
        command._allow_open_files()
        found = resource.getrlimit(resource.RLIMIT_NOFILE)
        assert found[0] == (65536 if hard == resource.RLIM_INFINITY else min(hard, 65536)) and found[1] == hard
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
