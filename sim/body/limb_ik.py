"""Arms and legs of a pose put where something asks for them, by two-bone inverse kinematics."""

import numpy as np

from sim.body.kinematics import two_bone_ik
from sim.body.pose import Pose
from sim.body.skeleton import BONE_OFFSETS, INDEX
from sim.math import rotations as rot
from sim.math.vectors import FORWARD

# The joints of a limb from the body outwards, each (2,): left and right.
LEGS, ARMS = (
    tuple(np.array([INDEX[side + name] for side in ("Left", "Right")]) for name in names)
    for names in (("UpLeg", "Leg", "Foot"), ("Arm", "ForeArm", "Hand"))
)
KNEES_FORWARD, ELBOWS_BACK = 1.0, -1.0
LEG_LENGTH = float(sum(np.linalg.norm(BONE_OFFSETS[joints[0]]) for joints in LEGS[1:]))  # metres
MOST_ASTRIDE = 0.9  # share of a leg's length that an ankle may be beside its hip joint for hips to sink on its account


def height_missing(sockets: np.ndarray, ankles: np.ndarray, length: np.ndarray | float) -> np.ndarray:
    """How far (...) hip joints (..., 3) must sink for legs as long as `length` (...) to reach ankles (..., 3), all in
    metres; negative where they need not."""
    reach = sockets - ankles
    across = np.minimum(np.hypot(reach[..., 0], reach[..., 2]), MOST_ASTRIDE * length)
    return reach[..., 1] - np.sqrt(length**2 - across**2)


def reach(pose: Pose, limbs: tuple[np.ndarray, ...], targets: np.ndarray, bend: float, share: float) -> Pose:
    """The pose with the ends of both limbs moved to (..., 2, 3) world metres; hands and feet keep their attitude.

    limbs: LEGS or ARMS. bend: which way a straight limb bends, KNEES_FORWARD or ELBOWS_BACK. share: of the limb's
    length that is used at most."""
    upper, lower, end = limbs
    p = pose.positions
    pole = bend * pose.to_world(FORWARD[None])
    turn_upper, turn_lower = two_bone_ik(
        p[..., upper, :], p[..., lower, :], p[..., end, :], targets, pole, share, hinge=limbs is LEGS
    )
    rotations = pose.rotations.copy()
    for joint, turn in ((upper, turn_upper), (lower, turn_lower)):
        rotations[..., joint, :] = rot.multiply(turn, rotations[..., joint, :])
    return pose.with_body(pose.hips, rotations)
