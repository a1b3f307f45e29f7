"""Which RApps this robot can run, by what they are written in."""

import json
from pathlib import Path

import pytest

from fakes.rapps import install_rapp, write_rapp
from rapp_core.errors import NO_RUNTIME, Invalid, Refused
from rapp_core.launcher.runtimes import check_runtime, runtime_at_hand
from rapp_core.manifest import read_manifest


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return write_rapp(tmp_path / "package", "probe", "", runtime="javascript")


def test_javascript_runs_where_node_and_its_websockets_are(package: Path, tmp_path: Path) -> None:
    check_runtime(read_manifest(package), node=tmp_path, library=tmp_path)


@pytest.mark.parametrize(
    ("node", "library", "missing"), [("no", "", "nodejs"), ("", "no", "node-ws"), ("no", "no", "nodejs and node-ws")]
)
def test_without_them_it_is_refused_with_the_next_step(
    package: Path, tmp_path: Path, node: str, library: str, missing: str
) -> None:
    with pytest.raises(Refused, match=f"cannot start probe: .* JavaScript.*; install the Debian packages {missing}$") as refused:
        check_runtime(read_manifest(package), node=tmp_path / node, library=tmp_path / library)
    assert refused.value.reason == NO_RUNTIME


def test_python_needs_neither(tmp_path: Path) -> None:
    manifest = read_manifest(write_rapp(tmp_path / "python", "probe"))
    check_runtime(manifest, node=tmp_path / "no", library=tmp_path / "no")


def test_a_language_that_is_not_known_is_invalid(package: Path) -> None:
    whole = json.loads((package / "package.json").read_text())
    whole["rapp"]["runtime"] = "cobol"
    (package / "package.json").write_text(json.dumps(whole))
    with pytest.raises(Invalid, match="cobol"):
        read_manifest(package)


def test_a_spare_has_node_at_hand_on_a_robot_with_such_rapps_only(tmp_path: Path) -> None:
    assert runtime_at_hand(tmp_path) == ""
    install_rapp(tmp_path, "other")
    (tmp_path / "rapps" / "broken" / "current").mkdir(parents=True)
    assert runtime_at_hand(tmp_path) == ""
    install_rapp(tmp_path, "probe", "", runtime="javascript")
    assert runtime_at_hand(tmp_path) == "javascript"
