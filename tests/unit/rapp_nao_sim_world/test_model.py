"""The model's tables agree with each other and with the NAO's data sheet."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from rapp_nao_sim.world.looks import COLOURS, looks, mesh
from rapp_nao_sim.world.model import BODY, CHAINS, JOINTS, LINKS, SHAPES, TWINS
from rapp_nao_sim.world.urdf import urdf, write_meshes


def test_the_body_has_the_26_joints_of_the_h25_in_naoqis_order() -> None:
    assert len(BODY) == len(set(BODY)) == 26
    assert set(BODY) == set(JOINTS)
    assert BODY[:4] == ["HeadYaw", "HeadPitch", "LShoulderPitch", "LShoulderRoll"]
    assert [BODY[7], BODY[8], BODY[14], BODY[25]] == ["LHand", "LHipYawPitch", "RHipYawPitch", "RHand"]


def test_chains_are_made_of_joints_and_cover_the_body() -> None:
    assert all(name in JOINTS for chain in CHAINS.values() for name in chain)
    parts = [name for chain in ("Head", "LArm", "RArm", "LLeg", "RLeg") for name in CHAINS[chain]]
    assert sorted(parts) == sorted(BODY)


def test_the_masses_add_up_to_the_robots() -> None:
    assert sum(link.mass for link in LINKS.values()) == pytest.approx(5.305, abs=0.002)


@pytest.mark.parametrize("name", [name for name in BODY if name.startswith("L")])
def test_the_right_side_mirrors_the_left(name: str) -> None:
    left, right = JOINTS[name], JOINTS["R" + name[1:]]
    assert right.offset == (left.offset[0], -left.offset[1], left.offset[2])
    assert (right.speed, right.torque) == (left.speed, left.torque)
    expected = (-left.upper, -left.lower) if name.endswith("Roll") else (left.lower, left.upper)
    assert (right.lower, right.upper) == pytest.approx(expected, abs=0.01)


def test_every_range_has_an_inside_and_every_axis_length_1() -> None:
    for joint in JOINTS.values():
        assert joint.lower < joint.upper
        assert math.hypot(*joint.axis) == pytest.approx(1)


def test_the_twin_joints_can_follow_each_other() -> None:
    for one, other in TWINS.items():
        assert TWINS[other] == one
        assert (JOINTS[one].lower, JOINTS[one].upper) == (JOINTS[other].lower, JOINTS[other].upper)


def test_the_links_form_one_tree_from_the_torso() -> None:
    children = [joint.child for joint in JOINTS.values()]
    assert len(children) == len(set(children))
    assert set(children) | {"torso"} == set(LINKS)
    known = {"torso"}
    for _ in JOINTS:
        known |= {joint.child for joint in JOINTS.values() if joint.parent in known}
    assert known == set(LINKS)


def test_shapes_and_shells_belong_to_links() -> None:
    assert set(SHAPES) <= set(LINKS)
    assert {link for link, _ in looks()} <= set(LINKS)
    assert {look.colour for _, look in looks()} <= set(COLOURS)


def test_the_legs_are_as_long_as_the_robots() -> None:
    height = -sum(JOINTS[name].offset[2] for name in CHAINS["LLeg"]) + 0.04511
    assert height == pytest.approx(0.085 + 0.1 + 0.1029 + 0.04511)


def test_the_urdf_holds_the_tables() -> None:
    root = ET.fromstring(urdf())
    assert {link.get("name") for link in root.findall("link")} == set(LINKS)
    limits = {joint.get("name"): joint.find("limit") for joint in root.findall("joint")}
    assert set(limits) == set(JOINTS)
    for name, limit in limits.items():
        assert limit is not None and name is not None
        assert float(str(limit.get("lower"))) == pytest.approx(JOINTS[name].lower, rel=1e-4)
        assert float(str(limit.get("effort"))) == pytest.approx(JOINTS[name].torque)
    assert root.findall(".//visual") == []
    assert len(root.findall(".//collision")) == sum(map(len, SHAPES.values()))


def test_the_urdf_with_looks_names_the_written_meshes(tmp_path: Path) -> None:
    root = ET.fromstring(urdf(write_meshes(tmp_path)))
    named = [Path(str(entry.get("filename"))) for entry in root.iter("mesh")]
    assert len(named) == len(list(looks()))
    assert all(path.is_file() for path in named)


def test_a_shell_is_closed_and_of_the_size_asked_for() -> None:
    _, look = next(looks())
    lines = [line.split() for line in mesh(look).splitlines()]
    vertices = [tuple(map(float, line[1:])) for line in lines if line[0] == "v"]
    normals = [tuple(map(float, line[1:])) for line in lines if line[0] == "vn"]
    assert max(z for _, _, z in vertices) == pytest.approx(look.half[2], abs=1e-5)
    assert max(y for _, y, _ in vertices) <= look.half[1] + 1e-6
    assert all(math.hypot(*normal) == pytest.approx(1, abs=1e-3) for normal in normals)
    edges: dict[tuple[str, str], int] = {}
    for line in lines:
        if line[0] == "f":
            for one, other in zip(line[1:], [*line[2:], line[1]], strict=True):
                edges[one, other] = edges.get((one, other), 0) + 1
    # Only the rims at the two poles, where all vertices are one point, are open.
    assert sum((other, one) not in edges for one, other in edges) == 2 * 28
