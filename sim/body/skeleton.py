"""The 21-joint skeleton, its rest pose and the five body parts: the one table everything else is derived from."""

import hashlib
import json

import numpy as np

# (joint, parent, offset from the parent in metres in the T-pose; Y up, facing +Z, left is +X)
_TABLE = [
    ("Hips", None, (0.0, 0.0, 0.0)),
    ("LeftUpLeg", "Hips", (0.09, -0.07, 0.0)),
    ("LeftLeg", "LeftUpLeg", (0.0, -0.43, 0.0)),
    ("LeftFoot", "LeftLeg", (0.0, -0.40, 0.0)),
    ("LeftToe", "LeftFoot", (0.0, -0.05, 0.13)),
    ("RightUpLeg", "Hips", (-0.09, -0.07, 0.0)),
    ("RightLeg", "RightUpLeg", (0.0, -0.43, 0.0)),
    ("RightFoot", "RightLeg", (0.0, -0.40, 0.0)),
    ("RightToe", "RightFoot", (0.0, -0.05, 0.13)),
    ("Spine", "Hips", (0.0, 0.11, 0.0)),
    ("Chest", "Spine", (0.0, 0.14, 0.0)),
    ("Neck", "Chest", (0.0, 0.25, 0.0)),
    ("Head", "Neck", (0.0, 0.10, 0.01)),
    ("LeftShoulder", "Chest", (0.05, 0.19, 0.0)),
    ("LeftArm", "LeftShoulder", (0.13, 0.0, 0.0)),
    ("LeftForeArm", "LeftArm", (0.28, 0.0, 0.0)),
    ("LeftHand", "LeftForeArm", (0.25, 0.0, 0.0)),
    ("RightShoulder", "Chest", (-0.05, 0.19, 0.0)),
    ("RightArm", "RightShoulder", (-0.13, 0.0, 0.0)),
    ("RightForeArm", "RightArm", (-0.28, 0.0, 0.0)),
    ("RightHand", "RightForeArm", (-0.25, 0.0, 0.0)),
]

JOINTS = tuple(name for name, _, _ in _TABLE)
INDEX = {name: i for i, name in enumerate(JOINTS)}
PARENTS = np.array([-1 if parent is None else INDEX[parent] for _, parent, _ in _TABLE])
BONE_OFFSETS = np.array([offset for _, _, offset in _TABLE])  # (21, 3) metres
JOINT_COUNT = len(JOINTS)
# (3,) from the hips, in metres
BETWEEN_HIPS = (BONE_OFFSETS[INDEX["LeftUpLeg"]] + BONE_OFFSETS[INDEX["RightUpLeg"]]) / 2

# ANCESTORS[j, k] is 1 where bone k lies on the chain from the root to joint j (j itself included).
ANCESTORS = np.eye(JOINT_COUNT)
for _joint in range(1, JOINT_COUNT):
    ANCESTORS[_joint] += ANCESTORS[PARENTS[_joint]]

TOE_HEIGHT = 0.02  # metres, a toe joint's height above the floor while the foot is flat
ANKLE_HEIGHT = TOE_HEIGHT - BONE_OFFSETS[INDEX["LeftToe"], 1]
REST_HIPS_HEIGHT = TOE_HEIGHT - sum(
    BONE_OFFSETS[INDEX[name], 1] for name in ("LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToe")
)

# The five body parts of Motion Puzzle (Jang et al. 2022, Eq. 4), in the order of the paper's f_s.
PARTS = {
    "left_leg": (1, 2, 3, 4),
    "right_leg": (5, 6, 7, 8),
    "spine": (0, 9, 10, 11, 12),
    "left_arm": (13, 14, 15, 16),
    "right_arm": (17, 18, 19, 20),
}
PART_NAMES = tuple(PARTS)
PART_OF_JOINT = np.array(
    [next(p for p, joints in enumerate(PARTS.values()) if j in joints) for j in range(JOINT_COUNT)]
)
GROUPS = {
    "legs": ("left_leg", "right_leg"),
    "arms": ("left_arm", "right_arm"),
    "upper": ("spine", "left_arm", "right_arm"),
    "all": PART_NAMES,
}

# Joints whose contact with the floor is labelled: left foot, left toe, right foot, right toe.
CONTACT_JOINTS = np.array([INDEX[name] for name in ("LeftFoot", "LeftToe", "RightFoot", "RightToe")])
TOES = CONTACT_JOINTS[1::2]

# The joint on the other side of the body (itself on the midline): what mirroring swaps.
MIRROR = np.array([INDEX[name.replace("Left", "#").replace("Right", "Left").replace("#", "Right")] for name in JOINTS])


def expand_part(name: str) -> tuple[str, ...]:
    """The body parts that a part or group name stands for. Raises ValueError for an unknown name."""
    if name in PARTS:
        return (name,)
    if name in GROUPS:
        return GROUPS[name]
    raise ValueError(f"unknown body part '{name}': use one of {', '.join((*PARTS, *GROUPS))}")


def skeleton_hash() -> str:
    """A short fingerprint of joints, parents and offsets, kept in weight files so that a mismatch is refused."""
    text = json.dumps([JOINTS, PARENTS.tolist(), BONE_OFFSETS.tolist()])
    return hashlib.sha256(text.encode()).hexdigest()[:16]
