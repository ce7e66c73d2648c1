"""Marks on the ground for a frame: soft contact shades, rings under planted feet, the arrow of the asked velocity."""

import numpy as np

from sim.pose import Pose
from sim.session import Frame
from sim.skeleton import CONTACT_JOINTS, INDEX

DISC, RING, ARROW = 0, 1, 2
ARROW_SECONDS = 0.55  # the arrow is as long as the way of this time
SHADE_JOINTS = [INDEX[name] for name in ("LeftFoot", "LeftToe", "RightFoot", "RightToe")]
RING_RADII = (0.105, 0.085, 0.105, 0.085)  # metres, of CONTACT_JOINTS
SHADE = (0.10, 0.12, 0.16)
CONTACT = (0.13, 0.60, 0.56)
WISH = (0.97, 0.60, 0.16)


def shades(pose: Pose, shift=(0.0, 0.0, 0.0)) -> list[tuple]:
    """Soft dark discs under the hips and under feet near the ground."""
    hips = pose.positions[0] + shift
    result = [(hips[0], hips[2], 0.55, 0.0, *SHADE, 0.16, DISC, 0.0)]
    for x, height, z in pose.positions[SHADE_JOINTS] + shift:
        strength = 0.50 * float(np.clip(1.0 - (height - 0.02) / 0.25, 0.0, 1.0)) ** 2
        result.append((x, z, 0.15, 0.0, *SHADE, strength, DISC, 0.0))
    return result


def contacts(pose: Pose) -> list[tuple]:
    """A ring round each foot joint on the ground, as strong as the contact."""
    return [(*pose.positions[joint, [0, 2]], radius, 0.0, *CONTACT, 0.85 * float(contact), RING, 0.012)
            for joint, contact, radius in zip(CONTACT_JOINTS, pose.contacts, RING_RADII, strict=True) if contact > 0.05]


def arrow(frame: Frame) -> list[tuple]:
    """From the character towards where the stick asks it to go; none while it is asked to stand."""
    way = frame.command.desired_velocity * ARROW_SECONDS
    reach = float(np.linalg.norm(way))
    if reach < 0.05:
        return []
    start = frame.styled.root_position[[0, 2]] + way / reach * 0.42
    return [(*start, *way, *WISH, 0.85, ARROW, 0.085)]
