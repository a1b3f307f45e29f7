"""Files among the arguments of calls: by path when the core agent knows them, else with the call."""

from pathlib import Path

import pytest

from rapp_api import files
from rapp_api.errors import Refused


def test_files_are_sorted_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "OURS", tmp_path / "rapp")
    own, recording = tmp_path / "rapp" / "private" / "door.jpg", tmp_path / "recordings" / "1.ogg"
    own.parent.mkdir(parents=True)
    own.write_bytes(b"JPEG")
    plain, sent = files.sorted_out("look", {"picture": own, "recording": recording, "times": 2})
    assert plain == {"recording": {"file": str(recording)}, "times": 2}
    assert sent == {"picture": (own, b"JPEG")}
    monkeypatch.chdir(own.parent)
    assert files.sorted_out("look", {"picture": Path("door.jpg")})[1] == {"picture": (Path("door.jpg"), b"JPEG")}
    with pytest.raises(Refused, match=r"nothing\.jpg"):
        files.sorted_out("look", {"picture": own.with_name("nothing.jpg")})
