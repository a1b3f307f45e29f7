"""What stops a walking robot: real-time critical, so it lies with the core agent and not with the RApp (paper section III)."""

from rapp_core.body_ports import Pose2D, Senses

STANDSTILL = 0.02  # m that a way to a side may lead ahead or back, as the robot sways
SLANT = 0.5  # of what it leads to the side: below, a way ahead or back is one to the side
ROUNDING = 1e-6  # m; less is no direction
LONG = 3600.0  # s; a velocity holds until it is stopped
SIDES = ("left", "right")


def lasting(velocity: Pose2D) -> Pose2D:
    """The way on which a velocity (m/s, m/s, rad/s) leads, however slow it is."""
    return Pose2D(velocity.x * LONG, velocity.y * LONG, velocity.theta * LONG)


def hazard(senses: Senses, way: Pose2D, near: float) -> str | None:
    """Why the robot must not walk on along `way`, what is left of it in base_link; None when it may.

    `near` is the distance (m) within which an obstacle ahead stops it. The sonars see ahead only; a robot whose toes have met
    something may still step back.
    """
    slant = SLANT * abs(way.y)
    if senses.fallen:
        return "the robot has fallen; help it up"
    if way.x >= -max(STANDSTILL, slant):
        for side, pressed in zip(SIDES, senses.bumpers, strict=True):
            if pressed:
                return f"the bumper of the {side} foot is pressed; step back"
    if way.x > max(ROUNDING, min(STANDSTILL, slant)):
        for side, distance in zip(SIDES, senses.sonar, strict=True):
            if distance < near:
                return f"there is an obstacle {distance:.2f} m ahead, seen by the {side} sonar; turn, or go round it"
    return None
