"""From keys and sticks to where the character shall go and look: plain functions of numbers, no device in sight."""

from typing import Collection

import numpy as np

DEAD_ZONE = 0.18  # share of a stick's way that worn sticks rest in
# Share of the full speed at which a stick that leaves its dead zone begins: a walk of 0.45 m/s. Slower than 0.4 m/s the
# controller hardly walks, and a third of the stick's way would move nothing.
SLOWEST = 0.35
TURN_RATE = 2.4  # radians a second that the facing keys turn

Vector = tuple[float, float]


def dead_zone(x: float, y: float) -> Vector:
    """A stick without its dead zone: a disc, so that diagonals start as softly as the axes; length at most 1."""
    length = float(np.hypot(x, y))
    if length <= DEAD_ZONE:
        return 0.0, 0.0
    scale = min((length - DEAD_ZONE) / (1 - DEAD_ZONE), 1.0) / length
    return x * scale, y * scale


def walking_stick(stick: Vector) -> Vector:
    """A stick without its dead zone as a wish to walk: from SLOWEST on, or nothing."""
    length = float(np.hypot(*stick))
    scale = SLOWEST / length + 1 - SLOWEST if length else 0.0
    return stick[0] * scale, stick[1] * scale


def stick_of_keys(held: Collection[str]) -> Vector:
    """The stick (right, away from the camera) that the held walking actions stand for, length at most 1."""
    x = float("right" in held) - float("left" in held)
    y = float("forward" in held) - float("back" in held)
    length = max(1.0, float(np.hypot(x, y)))
    return x / length, y / length


def to_world(stick: Vector, camera_yaw: float) -> Vector:
    """A stick (right, away from the camera) in world axes (x, z); the camera looks along `camera_yaw` radians."""
    sine, cosine = float(np.sin(camera_yaw)), float(np.cos(camera_yaw))
    x, z = -cosine * stick[0] + sine * stick[1], sine * stick[0] + cosine * stick[1]
    length = max(1.0, float(np.hypot(x, z)))  # rounding must not push a full stick past its length
    return x / length, z / length


def turn_of_keys(held: Collection[str], seconds: float) -> float:
    """How far the held facing actions turn in that time, radians; left is towards growing yaw."""
    return TURN_RATE * seconds * (float("face_left" in held) - float("face_right" in held))


def direction(yaw: float) -> Vector:
    """The unit vector (x, z) of a yaw."""
    return float(np.sin(yaw)), float(np.cos(yaw))
