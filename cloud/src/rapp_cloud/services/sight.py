"""What is in a picture: `hazard_detection_door_check`, `hazard_detection_light_check`, `qr_detection`.

Parameters and the fields door_angle, light_level, qr_centers and qr_messages are those of the original platform's services of these
names; the others say how sure the answer is. An answer that is not sure has the original's -1.
"""

import math
import os
from pathlib import Path
from typing import Any

from rapp_hop.errors import Invalid
from rapp_hop.service import Service, service

MAX_PICTURE = 16 * 2**20  # bytes
MOST_PIXELS = 16_000_000
NARROWEST, WIDEST = 20.0, 120.0  # degrees that a camera sees from left to right


@service(timeout=30, max_body=MAX_PICTURE, heavy=True, blank={"door_angle": -1})
def hazard_detection_door_check(file: Path, field_of_view: float = 60.97) -> dict[str, Any]:
    """Tell how far a door stands open, in degrees from 0 (closed) to 90; -1: not to be told from this picture."""
    if not NARROWEST <= field_of_view <= WIDEST:
        raise Invalid(f"cannot look through a camera of {field_of_view:g} degrees: {NARROWEST:g} to {WIDEST:g} are possible")
    picture = _picture(file)
    from rapp_cloud.vision.door import CLOSED, look_at_door

    door = look_at_door(picture, math.radians(field_of_view))
    angle = door.angle if door.sure else None
    return {
        "door_angle": -1 if angle is None else round(math.degrees(angle)),
        "open": None if angle is None else angle > CLOSED,
        "confidence": round(door.confidence, 2),
    }


@service(timeout=30, max_body=MAX_PICTURE, heavy=True, blank={"light_level": -1})
def hazard_detection_light_check(file: Path) -> dict[str, Any]:
    """Tell how brightly the lamp in the middle shines, from 0 (off) to 100; -1: not to be told from this picture."""
    picture = _picture(file)
    from rapp_cloud.vision.light import ON, look_at_lamp

    light = look_at_lamp(picture)
    level = light.level if light.sure else None
    return {
        "light_level": -1 if level is None else level,
        "on": None if level is None else level >= ON,
        "confidence": round(light.confidence, 2),
    }


@service(timeout=30, max_body=MAX_PICTURE, heavy=True, blank={"qr_centers": [], "qr_messages": []})
def qr_detection(file: Path) -> dict[str, Any]:
    """Read the QR codes of a picture: their texts, and where they are in pixels, in the same order."""
    picture = _picture(file)
    from rapp_cloud.vision.codes import read_codes

    codes = read_codes(picture)
    return {
        "qr_centers": [_point(code.centre) for code in codes],
        "qr_messages": [code.message for code in codes],
        "qr_corners": [[_point(corner) for corner in code.corners] for code in codes],
    }


def sight_services() -> list[Service]:
    """All of them; they run in worker processes, and only there OpenCV is loaded."""
    return [hazard_detection_door_check, hazard_detection_light_check, qr_detection]


def _picture(file: Path) -> Any:
    # OpenCV reads this bound when it is loaded: a small file may hold a picture that fills the memory.
    os.environ["OPENCV_IO_MAX_IMAGE_PIXELS"] = str(MOST_PIXELS)
    import cv2

    try:
        picture = cv2.imread(str(file), cv2.IMREAD_COLOR)
    except cv2.error as error:
        raise Invalid(f"cannot read the picture: {error.err}; at most {MOST_PIXELS} pixels are possible") from None
    if picture is None:
        raise Invalid("cannot read the picture: it is none that is known here; send JPEG or PNG")
    return picture


def _point(place: tuple[float, float]) -> dict[str, float]:
    return {"x": round(place[0], 1), "y": round(place[1], 1)}
