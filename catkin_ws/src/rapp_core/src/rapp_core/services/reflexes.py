"""What stops a walking robot: real-time critical, so it lies with the core agent and not with the RApp (paper section III)."""

from rapp_core.body_ports import Pose2D, Senses

STANDSTILL = 0.02  # m or m/s; less is no direction
SIDES = ("left", "right")


def hazard(senses: Senses, way: Pose2D, near: float) -> str | None:
    """Why the robot must not walk on along `way` (what is left of it, or a velocity, in base_link); None when it may.

    `near` is the distance (m) within which an obstacle ahead stops it. The sonars see ahead only; a robot whose toes have met
    something may still step back.
    """
    if senses.fallen:
        return "the robot has fallen; help it up"
    if way.x >= -STANDSTILL:
        for side, pressed in zip(SIDES, senses.bumpers, strict=True):
            if pressed:
                return f"the bumper of the {side} foot is pressed; step back"
    if way.x > STANDSTILL:
        for side, distance in zip(SIDES, senses.sonar, strict=True):
            if distance < near:
                return f"there is an obstacle {distance:.2f} m ahead, seen by the {side} sonar; turn, or go round it"
    return None
