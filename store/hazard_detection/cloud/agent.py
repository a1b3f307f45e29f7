"""The cloud agent: composes the platform's three services into an answer about door and lamp."""

import asyncio
from pathlib import Path
from typing import Any

from rapp_hop.cloud_agent import repository, service

PICTURE = 16 * 2**20  # bytes
SHOWN = 10  # degrees to which an angle is told


@service(max_body=PICTURE)
async def find_codes(picture: Path) -> dict[str, Any]:
    """Find the codes on the walls, by which the robot knows where it is: texts and corners in pixels."""
    found = await repository.call("qr_detection", {"file": picture})
    corners = [[[point["x"], point["y"]] for point in code] for code in found["qr_corners"]]
    return {"codes": [{"text": text, "corners": places} for text, places in zip(found["qr_messages"], corners, strict=True)]}


@service(max_body=2 * PICTURE, timeout=60)
async def check(door: Path, lamp: Path) -> dict[str, Any]:
    """Judge a picture of the door and one of the lamp; gives of each what it is, in words, or that it is not sure."""
    angle, level, by_door, by_lamp = await asyncio.gather(
        repository.call("hazard_detection_door_check", {"file": door}),
        repository.call("hazard_detection_light_check", {"file": lamp}),
        repository.call("qr_detection", {"file": door}),
        repository.call("qr_detection", {"file": lamp}),
    )
    return {
        "door": _door(angle) if _is_of("door", by_door) else _unsure("door"),
        "lamp": _lamp(level) if _is_of("lamp", by_lamp) else _unsure("lamp"),
    }


def _is_of(name: str, codes: dict[str, Any]) -> bool:
    """Whether a picture can be of a place: its wall shows the code of that place, or none that can be read."""
    texts = codes["qr_messages"]
    return not texts or any(name in text for text in texts)


def _door(found: dict[str, Any]) -> dict[str, Any]:
    if found["open"] is None:
        return _unsure("door")
    if not found["open"]:
        return {"sure": True, "hazard": False, "degrees": found["door_angle"], "words": "the door is closed"}
    shown = max(SHOWN, round(found["door_angle"] / SHOWN) * SHOWN)
    return {"sure": True, "hazard": True, "degrees": found["door_angle"], "words": f"the door is open by about {shown} degrees"}


def _lamp(found: dict[str, Any]) -> dict[str, Any]:
    if found["on"] is None:
        return _unsure("lamp")
    words = f"the lamp is {'on' if found['on'] else 'off'}"
    return {"sure": True, "hazard": bool(found["on"]), "level": found["light_level"], "words": words}


def _unsure(name: str) -> dict[str, Any]:
    return {"sure": False, "hazard": None, "words": f"I am not sure about the {name}"}
