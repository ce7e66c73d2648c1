"""What is taken from the network's output: a rotation for each joint and a shift of the hips, applied to the content.

A pose delta is (..., 22, 3): a rotation vector a joint, then the hips' shift in metres, all in the character's own
frame. Deltas may be scaled, smoothed and added; a zero delta changes nothing, so unstyled parts pass through
untouched."""

import numpy as np

from sim.body.limb_ik import ARMS, ELBOWS_BACK, reach
from sim.body.pose import Pose
from sim.body.skeleton import INDEX, JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot
from sim.motion.features import LAYOUT, rotations_of

HIPS_ROW = JOINT_COUNT
PART_OF_ROW = np.append(PART_OF_JOINT, PART_OF_JOINT[INDEX["Hips"]])
LIMB_REACH = 0.999  # share of an arm's length that is used
NEGLIGIBLE = 1e-5  # metres, or a share, that no hand is moved for: rounding is none
SHOULDERS = np.array([INDEX["LeftShoulder"], INDEX["RightShoulder"]])  # their place is the spine's doing alone
ARM_PARTS = PART_OF_JOINT[SHOULDERS]
LEG_PARTS = np.array([PART_NAMES.index(part) for part in ("left_leg", "right_leg")])


def pose_delta(styled: np.ndarray, content: np.ndarray) -> np.ndarray:
    """The delta (..., 22, 3) that leads from the content's features (..., 21, 15) to the styled ones."""
    delta = np.zeros((*styled.shape[:-2], len(PART_OF_ROW), 3))
    after, before = rotations_of(np.array([styled, content]))
    delta[..., :HIPS_ROW, :] = rot.to_rotation_vector(rot.from_matrix(after @ before.swapaxes(-1, -2)))
    hips = INDEX["Hips"]
    delta[..., HIPS_ROW, :] = styled[..., hips, LAYOUT["position"]] - content[..., hips, LAYOUT["position"]]
    return delta


def delta_weights(strengths: np.ndarray, legs: np.ndarray | None = None) -> np.ndarray:
    """(..., 22, 3) what a delta is scaled by, from the strengths (..., 5) of the parts. How high the hips are is the
    legs' doing: as much as both of them are styled, (..., 2), None for as much as their strengths say."""
    result = np.empty((*strengths.shape[:-1], len(PART_OF_ROW), 3))
    result[:] = strengths[..., PART_OF_ROW, None]
    result[..., HIPS_ROW, 1] = (strengths[..., LEG_PARTS] if legs is None else legs).min(axis=-1)
    return result


def unwrap(delta: np.ndarray, before: np.ndarray) -> np.ndarray:
    """The same delta (..., 22, 3), each rotation taken the way round the circle that is nearer to the delta before
    it."""
    turns = rot.nearest_turn(delta[..., :HIPS_ROW, :], before[..., :HIPS_ROW, :])
    return np.concatenate([turns, delta[..., HIPS_ROW:, :]], axis=-2)


def unwrap_frames(delta: np.ndarray) -> np.ndarray:
    """A clip's deltas (frames, 22, 3), each rotation taken the way round the circle that is nearest to the frame before
    it."""
    return np.concatenate([rot.unwrap(delta[:, :HIPS_ROW]), delta[:, HIPS_ROW:]], axis=1)


def rotations_of_delta(delta: np.ndarray) -> np.ndarray:
    """Quaternions (..., 21, 4) of a delta's rotations."""
    return rot.from_rotation_vector(delta[..., :HIPS_ROW, :])


def apply_delta(content: Pose, turns: np.ndarray, shift: np.ndarray) -> Pose:
    """The pose with its joints turned by quaternions (..., 21, 4) and its hips shifted by (..., 3), both in the
    character's frame; a joint that is not turned stays as it is to the last bit."""
    vectors = turns.copy()
    vectors[..., 1:] = content.to_world(turns[..., 1:])
    rotations = rot.normalize(rot.multiply(vectors, content.rotations))
    rotations = np.where(turns[..., 1:].any(axis=-1, keepdims=True), rotations, content.rotations)
    return content.with_body(content.hips + content.to_world(shift[..., None, :])[..., 0, :], rotations)


def preserve_hands(styled: Pose, content: Pose, strengths: np.ndarray) -> Pose:
    """Hands of arms that keep their own style stay where they were beside the hips, however the spine leans above them.

    strengths: (..., 2) of the left and the right arm; an arm in between gives way in between."""
    own = np.maximum(1 - strengths, 0)
    if own.max() < NEGLIGIBLE:
        return styled
    moved = styled.positions[..., SHOULDERS, :] - content.positions[..., SHOULDERS, :]
    carried = (moved - (styled.hips - content.hips)[..., None, :]) * own[..., None]
    which = np.abs(carried).max(axis=(-2, -1)) >= NEGLIGIBLE
    if not which.any():
        return styled
    after = reach(styled, ARMS, styled.positions[..., ARMS[-1], :] - carried, ELBOWS_BACK, LIMB_REACH)
    return (
        after
        if which.all()
        else styled.with_body(styled.hips, np.where(which[..., None, None], after.rotations, styled.rotations))
    )
