"""What is taken from the network's answer: a turn for each joint and a shift of the hips, put on top of the content.

They are rows (..., 22, 3): a rotation vector a joint, then the hips' shift in metres, in the character's own frame. Rows may
be scaled, smoothed and added; zero rows change nothing, so unstyled parts pass through untouched."""

from typing import Callable

import numpy as np

from sim import rotations as rot
from sim.features import LAYOUT, rotations_of
from sim.limbs import ARMS, ELBOWS_BACK, KNEES_FORWARD, LEGS, reach
from sim.pose import Pose
from sim.skeleton import CONTACT_JOINTS, INDEX, JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.vectors import UP

HIPS_ROW = JOINT_COUNT
PART_OF_ROW = np.append(PART_OF_JOINT, PART_OF_JOINT[INDEX["Hips"]])
LIMB_REACH = 0.999  # share of an arm's or a leg's length that is used
SHOULDERS = np.array([INDEX["LeftShoulder"], INDEX["RightShoulder"]])  # their place is the spine's doing alone
ARM_PARTS = PART_OF_JOINT[SHOULDERS]
BEARING_PARTS = np.array([PART_NAMES.index(part) for part in ("spine", "left_leg", "right_leg")])


def asked(styled: np.ndarray, content: np.ndarray) -> np.ndarray:
    """Rows (..., 22, 3) that lead from the content's features (..., 21, 15) to the styled ones."""
    rows = np.zeros((*styled.shape[:-2], len(PART_OF_ROW), 3))
    after, before = rotations_of(np.array([styled, content]))
    rows[..., :HIPS_ROW, :] = rot.to_rotation_vector(rot.from_matrix(after @ before.swapaxes(-1, -2)))
    hips = INDEX["Hips"]
    rows[..., HIPS_ROW, :] = styled[..., hips, LAYOUT["position"]] - content[..., hips, LAYOUT["position"]]
    return rows


def scales(strengths: np.ndarray) -> np.ndarray:
    """(..., 22, 3) what rows are scaled by, from the strengths (..., 5) of the parts. How high the hips are is the legs' doing
    too."""
    result = np.empty((*strengths.shape[:-1], len(PART_OF_ROW), 3))
    result[:] = strengths[..., PART_OF_ROW, None]
    result[..., HIPS_ROW, 1] = height_share(strengths)
    return result


def height_share(strengths: np.ndarray) -> np.ndarray:
    """How far (...) the height of the hips is the style's: as far as spine and both legs wear one. strengths: (..., 5)."""
    return strengths[..., BEARING_PARTS].min(axis=-1)


def continued(rows: np.ndarray, before: np.ndarray) -> np.ndarray:
    """The same rows (..., 22, 3), turns told the other way round the circle where that is nearer to the rows before them: a turn
    of about half a circle must not change its direction from one frame to the next."""
    turns, last = rows[..., :HIPS_ROW, :], before[..., :HIPS_ROW, :]
    other = turns * (1 - 2 * np.pi / np.maximum(rot.length(turns), 1e-9))
    nearer = rot.length(other - last) < rot.length(turns - last)
    return np.concatenate([np.where(nearer, other, turns), rows[..., HIPS_ROW:, :]], axis=-2)


def turned(content: Pose, rows: np.ndarray) -> Pose:
    """The pose with its joints turned and its hips shifted by rows (22, 3); a pose of many frames takes rows for each."""
    rows = content.to_world(rows)
    turns = rows[..., :HIPS_ROW, :]
    rotations = rot.normalize(rot.multiply(rot.from_rotation_vector(turns), content.rotations))
    rotations = np.where(turns.any(axis=-1, keepdims=True), rotations, content.rotations)  # to the last bit where nothing is worn
    return content.with_body(content.hips + rows[..., HIPS_ROW, :], rotations)


def feet_off(styled: Pose, content: Pose) -> np.ndarray:
    """How far (...) the lowest joint of the styled feet is under the content's lowest, in metres."""
    return content.positions[..., CONTACT_JOINTS, 1].min(axis=-1) - styled.positions[..., CONTACT_JOINTS, 1].min(axis=-1)


def feet_raised(styled: Pose, height: np.ndarray) -> Pose:
    """Both feet moved up by a height (...) in metres, the hips staying where they are; nothing where it is 0."""
    targets = styled.positions[..., LEGS[-1], :] + np.multiply.outer(height, UP)[..., None, :]
    return _only(height != 0, styled, lambda: reach(styled, LEGS, targets, KNEES_FORWARD, LIMB_REACH))


def hands_kept(styled: Pose, content: Pose, strengths: np.ndarray) -> Pose:
    """Hands of arms that keep their own style stay where they were beside the hips, however the spine leans above them.

    strengths: (..., 2) of the left and the right arm; an arm in between gives way in between."""
    own = np.maximum(1 - strengths, 0)
    if not own.any():
        return styled
    moved = styled.positions[..., SHOULDERS, :] - content.positions[..., SHOULDERS, :]
    carried = (moved - (styled.hips - content.hips)[..., None, :]) * own[..., None]
    targets = styled.positions[..., ARMS[-1], :] - carried
    return _only(np.abs(carried).max(axis=(-2, -1)) >= 1e-9, styled,
                 lambda: reach(styled, ARMS, targets, ELBOWS_BACK, LIMB_REACH))


def _only(which: np.ndarray, pose: Pose, changed: Callable[[], Pose]) -> Pose:
    """Of a crowd only these (...) changed, the others to the last bit as they are."""
    if not which.any():
        return pose
    after = changed()
    return after if which.all() else pose.with_body(
        pose.hips, np.where(which[..., None, None], after.rotations, pose.rotations))
