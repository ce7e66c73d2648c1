"""What is taken from the network's answer: a turn for each joint and a shift of the hips, put on top of the content.

They are rows (..., 22, 3): a rotation vector a joint, then the hips' shift in metres, in the character's own frame. Rows may
be scaled, smoothed and added; zero rows change nothing, so unstyled parts pass through untouched."""

import numpy as np

from sim import rotations as rot
from sim.features import LAYOUT, rotations_of
from sim.limbs import ARMS, ELBOWS_BACK, KNEES_FORWARD, LEGS, reach
from sim.pose import Pose
from sim.skeleton import CONTACT_JOINTS, INDEX, JOINT_COUNT, PART_NAMES, PART_OF_JOINT

HIPS_ROW = JOINT_COUNT
PART_OF_ROW = np.append(PART_OF_JOINT, PART_OF_JOINT[INDEX["Hips"]])
LIMB_REACH = 0.999  # share of an arm's or a leg's length that is used
SHOULDERS = np.array([INDEX["LeftShoulder"], INDEX["RightShoulder"]])  # their place is the spine's doing alone
ARM_PARTS = PART_OF_JOINT[SHOULDERS]
BEARING_PARTS = np.array([PART_NAMES.index(part) for part in ("spine", "left_leg", "right_leg")])


def asked(styled: np.ndarray, content: np.ndarray) -> np.ndarray:
    """Rows (..., 22, 3) that lead from the content's features (..., 21, 15) to the styled ones."""
    rows = np.zeros((*styled.shape[:-2], len(PART_OF_ROW), 3))
    after, before = rotations_of(np.stack([styled, content]))
    rows[..., :HIPS_ROW, :] = rot.to_rotation_vector(rot.multiply(after, rot.inverse(before)))
    hips = INDEX["Hips"]
    rows[..., HIPS_ROW, :] = styled[..., hips, LAYOUT["position"]] - content[..., hips, LAYOUT["position"]]
    return rows


def scales(strengths: np.ndarray) -> np.ndarray:
    """(22, 3) what rows are scaled by, from the strengths (5,) of the parts. How high the hips are is the legs' doing too."""
    result = np.repeat(strengths[PART_OF_ROW, None], 3, axis=1)
    result[HIPS_ROW, 1] = height_share(strengths)
    return result


def height_share(strengths: np.ndarray) -> float:
    """How far the height of the hips is the style's: as far as spine and both legs wear one."""
    return float(strengths[BEARING_PARTS].min())


def continued(rows: np.ndarray, before: np.ndarray) -> np.ndarray:
    """The same rows (22, 3), turns told the other way round the circle where that is nearer to the rows before them: a turn
    of about half a circle must not change its direction from one frame to the next."""
    turns, last = rows[:HIPS_ROW], before[:HIPS_ROW]
    angle = np.linalg.norm(turns, axis=-1, keepdims=True)
    other = turns * (1 - 2 * np.pi / np.maximum(angle, 1e-9))
    nearer = np.linalg.norm(other - last, axis=-1) < np.linalg.norm(turns - last, axis=-1)
    return np.concatenate([np.where(nearer[:, None], other, turns), rows[HIPS_ROW:]])


def turned(content: Pose, rows: np.ndarray) -> Pose:
    """The pose with its joints turned and its hips shifted by rows (22, 3); a pose of many frames takes rows for each."""
    rows = rot.rotate(rot.from_yaw(content.root_facing)[..., None, :], rows)
    moved = rows[..., :HIPS_ROW, :].any(axis=-1)
    rotations = content.rotations.copy()
    turns = rot.from_rotation_vector(rows[..., :HIPS_ROW, :][moved])
    rotations[moved] = rot.normalize(rot.multiply(turns, rotations[moved]))
    return content.with_body(content.hips + rows[..., HIPS_ROW, :], rotations)


def feet_off(styled: Pose, content: Pose) -> np.ndarray:
    """How far (...) the lowest joint of the styled feet is under the content's lowest, in metres."""
    return content.positions[..., CONTACT_JOINTS, 1].min(axis=-1) - styled.positions[..., CONTACT_JOINTS, 1].min(axis=-1)


def feet_raised(styled: Pose, height: np.ndarray) -> Pose:
    """Both feet moved up by a height (...) in metres, the hips staying where they are."""
    targets = styled.positions[..., LEGS[-1], :] + np.asarray(height)[..., None, None] * [0.0, 1.0, 0.0]
    return reach(styled, LEGS, targets, KNEES_FORWARD, LIMB_REACH)


def hands_kept(styled: Pose, content: Pose, strengths: np.ndarray) -> Pose:
    """Hands of arms that keep their own style stay where they were beside the hips, however the spine leans above them.

    strengths: (2,) of the left and the right arm; an arm in between gives way in between."""
    def beside(pose: Pose) -> np.ndarray:
        return pose.positions[..., SHOULDERS, :] - pose.hips[..., None, :]

    carried = (beside(styled) - beside(content)) * np.clip(1 - strengths, 0, 1)[:, None]
    if np.abs(carried).max() < 1e-9:
        return styled
    return reach(styled, ARMS, styled.positions[..., ARMS[-1], :] - carried, ELBOWS_BACK, LIMB_REACH)
