"""Where the head of a NAO has to turn to look at a point (NAO H25: neck and top camera as in its documentation)."""

import math
from collections.abc import Sequence

NECK = 0.1265  # m, of the neck's joints above the torso's frame
CAMERA_AHEAD, CAMERA_ABOVE = 0.05871, 0.06364  # m, of the top camera from the neck, at rest
CAMERA_DOWN = 0.0209  # rad by which the top camera looks down, at rest


def gaze(torso: Sequence[float], x: float, y: float, z: float) -> tuple[float, float] | None:
    """HeadYaw and HeadPitch (rad) that bring a point in base_link (m) into the middle of the top camera's picture.

    `torso` is the torso's matrix in base_link, row by row. None for a point inside the head, at which nothing can look.
    """
    shifted = [value - torso[4 * row + 3] for row, value in enumerate((x, y, z))]
    ahead, left, above = (sum(torso[4 * row + column] * shifted[row] for row in range(3)) for column in range(3))
    above -= NECK
    flat = math.hypot(ahead, left)
    distance = math.hypot(flat, above)
    # The point lies on the camera's axis when both are equally far from the neck, square to that axis.
    offset = CAMERA_AHEAD * math.sin(CAMERA_DOWN) + CAMERA_ABOVE * math.cos(CAMERA_DOWN)
    if distance <= math.hypot(CAMERA_AHEAD, CAMERA_ABOVE):
        return None
    pitch = math.asin(offset / distance) - math.atan2(above, flat) - CAMERA_DOWN
    return math.atan2(left, ahead), pitch
