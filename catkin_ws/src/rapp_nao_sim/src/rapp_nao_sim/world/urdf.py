"""The model's tables as URDF text."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rapp_nao_sim.world.looks import COLOURS, Look, shells
from rapp_nao_sim.world.model import JOINTS, LINKS, SHAPES, Joint, Link, Shape

_Visuals = Mapping[str, Sequence[tuple[Path, Look]]]


def write_meshes(folder: Path, own_view: bool = False) -> dict[str, list[tuple[Path, Look]]]:
    """Write the shells' meshes, as all or as the robot itself sees them, into a folder; gives for each link what `urdf` takes."""
    written: dict[str, list[tuple[Path, Look]]] = {}
    for number, (link, look, mesh) in enumerate(shells(own_view)):
        path = folder / f"{number}.obj"
        path.write_text(mesh)
        written.setdefault(link, []).append((path, look))
    return written


def urdf(visuals: _Visuals | None = None) -> str:
    """The robot as URDF; without `visuals` it has no looks but the same physics."""
    lines = ['<robot name="nao">']
    for name, (red, green, blue) in COLOURS.items():
        lines.append(f'<material name="{name}"><color rgba="{red} {green} {blue} 1"/></material>')
    for name, link in LINKS.items():
        lines.extend(_link(name, link, SHAPES.get(name, ()), (visuals or {}).get(name, ())))
    lines.extend(_joint(name, joint) for name, joint in JOINTS.items())
    lines.append("</robot>")
    return "\n".join(lines)


def _numbers(values: Sequence[float]) -> str:
    return " ".join(f"{value:.7g}" for value in values)


def _link(name: str, link: Link, shapes: Sequence[Shape], visuals: Sequence[tuple[Path, Look]]) -> Iterator[str]:
    xx, yy, zz = link.inertia
    yield f'<link name="{name}"><inertial><origin xyz="{_numbers(link.centre)}"/><mass value="{link.mass:g}"/>'
    yield f'<inertia ixx="{xx:g}" ixy="0" ixz="0" iyy="{yy:g}" iyz="0" izz="{zz:g}"/></inertial>'
    for shape in shapes:
        yield f"<collision>{_origin(shape)}<geometry>{_geometry(shape)}</geometry></collision>"
    for path, look in visuals:
        yield f'<visual><origin xyz="{_numbers(look.centre)}" rpy="0 {look.pitch:g} 0"/><geometry>'
        yield f'<mesh filename="{path}"/></geometry><material name="{look.colour}"/></visual>'
    yield "</link>"


def _origin(shape: Shape) -> str:
    pitch = math.pi / 2 if shape.kind == "rod" else 0.0  # URDF's cylinders stand along z
    return f'<origin xyz="{_numbers(shape.centre)}" rpy="0 {pitch:.7g} 0"/>'


def _geometry(shape: Shape) -> str:
    match shape.kind:
        case "box":
            return f'<box size="{_numbers(shape.size)}"/>'
        case "ball":
            return f'<sphere radius="{shape.size[0]:g}"/>'
        case _:
            return f'<cylinder radius="{shape.size[0]:g}" length="{shape.size[1]:g}"/>'


def _joint(name: str, joint: Joint) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{joint.parent}"/><child link="{joint.child}"/>'
        f'<origin xyz="{_numbers(joint.offset)}"/><axis xyz="{_numbers(joint.axis)}"/>'
        f'<limit lower="{joint.lower:g}" upper="{joint.upper:g}" velocity="{joint.speed:g}" effort="{joint.torque:g}"/></joint>'
    )
