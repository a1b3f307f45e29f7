"""What the feet feel: weight on their corners, and things against their bumpers."""

from typing import Any

from rapp_nao_sim.world.body import Body

_GRAVITY = 9.81
# Pressure sensors of the left foot, in the ankle's frame (m): x of the front and rear ones, y of the left and right ones.
_FRONT, _REAR = 0.0703, -0.03
_EDGES = {"L": (0.0299, -0.0211), "R": (0.0211, -0.0299)}
_TOE = 0.06  # m before the ankle: contacts ahead of it press a bumper
_UPRIGHT = 0.7  # of a contact's normal: it carries weight

Contact = tuple[float, float, float, float, float]  # x, y, z in the ankle's frame; how upright its normal is; force in N


def weights(side: str, contacts: list[Contact]) -> tuple[float, ...]:
    """kg on a foot's front left, front right, rear left and rear right sensor: each contact by its place between them."""
    left, right = _EDGES[side]
    corners = [0.0] * 4
    for x, y, _, upright, force in contacts:
        if upright > _UPRIGHT:
            ahead = min(1.0, max(0.0, (x - _REAR) / (_FRONT - _REAR)))
            aside = min(1.0, max(0.0, (y - right) / (left - right)))
            weight = force / _GRAVITY
            for number, share in enumerate((ahead * aside, ahead * (1 - aside), (1 - ahead) * aside, (1 - ahead) * (1 - aside))):
                corners[number] += weight * share
    return tuple(corners)


def bumped(side: str, contacts: list[Contact]) -> set[str]:
    """The bumpers of a foot that something is against."""
    pressed = [y for x, y, _, upright, force in contacts if upright < _UPRIGHT and x > _TOE and force > 0]
    return {f"{side}Foot/Bumper/{'Left' if y > 0 else 'Right'}" for y in pressed}


def contacts(bullet: Any, body: Body, side: str) -> list[Contact]:
    """Where the room touches a foot."""
    position, orientation = body.frame(f"{side}Ankle")
    position, orientation = bullet.invertTransform(position, orientation)
    found = []
    for point in body.contacts(f"{side}Ankle"):
        (x, y, z), _ = bullet.multiplyTransforms(position, orientation, point[5], (0, 0, 0, 1))
        found.append((x, y, z, abs(point[7][2]), point[9]))
    return found
