"""The body as a few capsules fixed to its joints: as thick as the figure that is drawn, for what must not go through
it, and for the light that it takes."""

import numpy as np

from sim.body.pose import Pose
from sim.body.skeleton import INDEX
from sim.math import rotations as rot

# (joint, from, to, radius): metres in the joint's own axes in the T-pose; one of a left joint has its mirror image on
# the right. Trunk and hips are wider than deep, so their capsules lie across.
_TABLE = [
    ("Hips", (-0.060, -0.020, -0.006), (0.060, -0.020, -0.006), 0.096),
    ("Spine", (-0.040, 0.030, 0.0), (0.040, 0.030, 0.0), 0.082),
    ("Chest", (-0.050, 0.040, 0.004), (0.050, 0.040, 0.004), 0.094),
    ("Chest", (-0.068, 0.125, 0.004), (0.068, 0.125, 0.004), 0.098),
    ("Neck", (0.0, -0.020, -0.012), (0.0, 0.080, 0.0), 0.050),
    ("Head", (0.0, 0.100, -0.012), (0.0, 0.050, 0.030), 0.080),
    ("LeftUpLeg", (0.004, -0.020, 0.002), (0.0, -0.400, 0.004), 0.072),
    ("LeftLeg", (0.0, -0.020, 0.0), (0.0, -0.360, -0.008), 0.046),
    ("LeftFoot", (0.0, -0.030, -0.020), (0.004, -0.040, 0.110), 0.034),
    ("LeftArm", (0.010, 0.0, 0.0), (0.260, 0.0, 0.0), 0.044),
    ("LeftForeArm", (0.010, 0.0, 0.0), (0.230, 0.0, 0.0), 0.032),
    ("LeftHand", (0.020, -0.004, 0.004), (0.120, -0.016, 0.004), 0.026),
]


def _mirrored(row: tuple) -> tuple:
    joint, start, stop, radius = row
    return (joint.replace("Left", "Right"), *((-x, y, z) for x, y, z in (start, stop)), radius)


ROWS = _TABLE + [_mirrored(row) for row in _TABLE if row[0].startswith("Left")]
CAPSULE_JOINT = np.array([INDEX[row[0]] for row in ROWS])
CAPSULE_ENDS = np.array([row[1:3] for row in ROWS])  # (capsules, 2, 3)
CAPSULE_RADII = np.array([row[3] for row in ROWS])


def capsule_ends(pose: Pose, which: np.ndarray | slice = slice(None)) -> np.ndarray:
    """(..., capsules, 2, 3) both ends of all capsules of a pose, or of some, in the world."""
    joints = CAPSULE_JOINT[which]
    turned = rot.rotate(pose.rotations[..., joints, None, :], CAPSULE_ENDS[which])
    return pose.positions[..., joints, None, :] + turned
