"""Forward kinematics of the 21 joints and analytic two-bone inverse kinematics."""

import numpy as np

from sim.body.skeleton import ANCESTORS, BONE_OFFSETS, JOINT_COUNT, PARENTS
from sim.math import rotations as rot
from sim.math.easing import smooth_step

# metres between the knee and the line from hip to ankle, under which the plane of a bend is not to be trusted
STRAIGHT = 0.02
# shares of a limb's length between its ends: below the first the line between them says nothing of its plane
FOLDED = (0.1, 0.3)


def forward_kinematics(hips: np.ndarray, global_rotations: np.ndarray) -> np.ndarray:
    """Joint positions (..., 21, 3) in metres from hips positions (..., 3) and global rotations (..., 21, 4).

    With global rotations a joint is the sum of the turned bones above it: one matrix product, no loop over the
    chain."""
    bones = np.empty((*global_rotations.shape[:-1], 3))
    bones[..., 0, :] = hips
    bones[..., 1:, :] = rot.rotate(global_rotations[..., PARENTS[1:], :], BONE_OFFSETS[1:])
    return ANCESTORS @ bones


def to_global(local_rotations: np.ndarray) -> np.ndarray:
    """Local rotations (..., 21, 4) to global ones."""
    result = local_rotations.copy()
    for joint in range(1, JOINT_COUNT):
        result[..., joint, :] = rot.multiply(result[..., PARENTS[joint], :], local_rotations[..., joint, :])
    return result


def to_local(global_rotations: np.ndarray) -> np.ndarray:
    """Global rotations (..., 21, 4) to rotations relative to the parent (the root's stays global)."""
    local = rot.multiply(rot.inverse(global_rotations[..., PARENTS, :]), global_rotations)
    local[..., 0, :] = global_rotations[..., 0, :]
    return local


def two_bone_ik(
    hip: np.ndarray,
    knee: np.ndarray,
    ankle: np.ndarray,
    target: np.ndarray,
    pole: np.ndarray,
    reach: float = 0.999,
    hinge: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """World rotations (..., 4), (..., 4) to put before the upper and the lower bone so that the ankle meets the target.

    hip, knee, ankle, target: (..., 3) world metres. pole: (..., 3) where the knee points when the leg is straight and
    its bend has no plane of its own; a nearly straight hinge never points away from there. A target out of reach is
    approached along the line to it, up to `reach` of the leg's length."""
    bones = np.array([knee - hip, ankle - knee])
    (upper, lower), wanted = rot.length(bones), target - hip
    distance = np.minimum(np.maximum(rot.length(wanted), np.abs(upper - lower) + 1e-3), (upper + lower) * reach)
    current = ankle - hip
    # A limb that is folded altogether has hardly an axis: its elbow or knee then stays as near as it can.
    folded = 1 - smooth_step(rot.length(current) / (upper + lower), *FOLDED)
    current = current + folded * (wanted - current)
    current, axis = rot.normalize(current), rot.normalize(wanted)

    # The bend keeps the plane the leg has now; a straight leg has none, so the pole leans in as the leg straightens.
    bend = _without(bones[0], current)
    bent = rot.length(bend)
    # a knee that is stretched a little too far must not be thrown about where the pole just makes up for that
    if hinge:
        forward = _dot(bend, pole)
        bent = rot.length(bend - pole * forward) + forward
    bend = bend + pole * np.maximum(0.0, STRAIGHT - bent)
    # The shortest turn from the current to the new axis takes it there: of Rodrigues' formula, what is square to the
    # new axis.
    between = current + axis
    bend = bend - current * (_dot(bend, between) / np.maximum(_dot(current, between), 1e-9))
    bend = rot.normalize(_without(bend, axis))

    cosine = np.minimum((upper**2 + distance**2 - lower**2) / (2 * upper * distance), 1.0)
    new_knee = upper * (cosine * axis + np.sqrt(1.0 - cosine**2) * bend)
    turns = rot.between(bones, np.array([new_knee, distance * axis - new_knee]))
    return turns[0], turns[1]


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.vecdot(a, b)[..., None]


def _without(v: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """What of v is square to a unit axis."""
    return v - axis * _dot(v, axis)
