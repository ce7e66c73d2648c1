"""The figure as it is drawn: how its skin follows a pose, in which colours, and on what it stands."""

from dataclasses import dataclass

import numpy as np

from demo.figure.forms import BIND
from demo.figure.skin import Model, crowd_model, own_model
from sim.body.capsules import capsule_ends
from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT, PART_NAMES
from sim.math import rotations as rot


@dataclass(frozen=True)
class Figure:
    """A body as the passes read it: `bones` (4 joints, 3), `tints` (5, 4) display colours by body part, both float32;
    `plane` (3,) of the ground under it: its height at the origin, and the metres that it rises in a metre of x and of
    z; the ends (capsules, 2, 3) of the capsules that keep light from it (sim.body.capsules); and what it is drawn
    as."""

    bones: np.ndarray
    tints: np.ndarray
    plane: np.ndarray
    capsules: np.ndarray
    model: Model


def figure(
    pose: Pose,
    part_colours: np.ndarray,
    shift: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0),
    plane: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Figure:
    """The body in `pose`, moved by `shift` metres, in display colours (5, 3) in the order of PART_NAMES, on a plane as
    Figure has it."""
    tints = np.ones((len(PART_NAMES), 4), np.float32)
    tints[:, :3] = part_colours
    return Figure(bones(pose, shift), tints, np.asarray(plane), capsule_ends(pose) + shift, own_model())


def bones(pose: Pose, shift: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """(..., 84, 3) float32: for each joint the transform (4, 3) of row vectors from the bind pose to `pose` moved by
    `shift`."""
    turns = rot.multiply(pose.rotations, rot.inverse(BIND.rotations))
    result = np.empty((*turns.shape[:-2], JOINT_COUNT, 4, 3), np.float32)
    result[..., :3, :] = rot.rotate(turns[..., None, :], np.eye(3))
    result[..., 3, :] = pose.positions + shift - rot.rotate(turns, BIND.positions)
    return result.reshape(*turns.shape[:-2], -1, 3)


def crowd_figures(poses: Pose, part_colours: np.ndarray, planes: np.ndarray) -> list[Figure]:
    """Many bodies at once, in poses with a leading axis and colours (n, 5, 3), on planes (n, 3)."""
    tints = np.ones((*part_colours.shape[:2], 4), np.float32)
    tints[..., :3] = part_colours
    return [Figure(*each, crowd_model()) for each in zip(bones(poses), tints, planes, capsule_ends(poses), strict=True)]
