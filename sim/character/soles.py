"""What of a character's foot touches the floor: the corners of its mesh that are lowest however the foot is tilted."""

from dataclasses import dataclass

import numpy as np

from sim.body.skeleton import ANKLE_HEIGHT, INDEX, TOE_HEIGHT
from sim.character.mesh import SkinnedMesh
from sim.math import rotations as rot
from sim.math.vectors import FORWARD, LEFT, UP

PITCHES, ROLLS = np.radians(np.linspace(-70.0, 70.0, 15)), np.radians((-20.0, 0.0, 20.0))
MOSTLY = 0.5  # a corner belongs to the joint that has more than this of it
BALL = 0.7  # of a foot's length from ankle to tip: where a foot without a toe joint is taken to bend


@dataclass(frozen=True)
class Sole:
    """Of one foot: floor, its height under the foot in the rest pose; points (n, 3) from ankle or toe joint, as the
    rest pose has them; on_toe (n,) whether a point follows the toes; ball (3,) from the ankle to where the foot
    bends."""

    floor: float
    points: np.ndarray
    on_toe: np.ndarray
    ball: np.ndarray


def find_sole(
    side: str, index: dict[str, int], rest: np.ndarray, corners: np.ndarray, mesh: SkinnedMesh, owners: np.ndarray
) -> Sole:
    """The sole of a foot, in our unit, from corners (n, 3) of its mesh, which faces +Z; of a foot without a mesh, as
    ours is."""
    ankle = rest[index[side + "Foot"]]
    toe = rest[index[side + "Toe"]] if side + "Toe" in index else None
    strongest = mesh.joints[np.arange(len(corners)), mesh.weights.argmax(axis=-1)]
    owner = owners[strongest, 0]
    sure = mesh.weights.max(axis=-1) > MOSTLY
    of_foot = sure & (owner == INDEX[side + "Foot"]) & (corners[:, 1] < ankle[1])
    of_toe = sure & (owner == INDEX[side + "Toe"])
    points, on_toe = corners[of_foot | of_toe], of_toe[of_foot | of_toe]
    if not len(points):
        ahead = toe if toe is not None else ankle + [0.0, TOE_HEIGHT - ANKLE_HEIGHT, 0.13]
        points = np.array([ankle - UP * ANKLE_HEIGHT, ahead - UP * TOE_HEIGHT])
        on_toe = np.array([False, toe is not None])
    turns = rot.multiply(rot.from_axis_angle(LEFT, PITCHES)[:, None], rot.from_axis_angle(FORWARD, ROLLS))
    downs = -rot.rotate(rot.inverse(turns.reshape(-1, 4)), UP)  # where down is, seen from a tilted foot
    lowest = [np.flatnonzero(part)[(points[part] @ downs.T).argmax(axis=0)] for part in (on_toe, ~on_toe) if part.any()]
    kept = np.unique(np.concatenate(lowest))
    floor = float(points[:, 1].min())
    if toe is not None:
        ball = toe - ankle
    else:
        ball = np.array([0.0, floor + TOE_HEIGHT - ankle[1], BALL * (points[:, 2].max() - ankle[2])])
    origin = np.where(on_toe[:, None], toe if toe is not None else ankle, ankle)
    return Sole(floor, (points - origin)[kept], on_toe[kept], ball)
