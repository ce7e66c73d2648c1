"""Playback at another rate than the network's own: poses in between, by a parabola through the last three."""

from itertools import pairwise

import numpy as np

from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT
from sim.math import rotations as rot

CATCH_UP = 0.02  # frames a frame by which a motion that is played at its own rate again comes back to whole frames
# Where the numbers of a pose lie side by side in a row; the angles are the root's facing and the phase.
ROTATIONS, ANGLES, CONTACTS, ROOT, HIPS = (slice(*ends) for ends in pairwise((0, 4 * JOINT_COUNT, 86, 90, 93, 96)))


class Playback:
    """How far between its last two poses a motion is. Any leading axes, of a crowd."""

    def __init__(self, crowd: tuple[int, ...] = ()) -> None:
        self.clock = np.ones(crowd)  # 0..1 from the last pose but one to the last
        self._rows: np.ndarray | None = None  # (3, ..., 96) the last three poses

    def advance(self, rate: np.ndarray | float) -> list[np.ndarray]:
        """Lets a frame pass at a rate (...). For each frame that the motion has to go on by: whose (...) it is."""
        rate = np.where(np.equal(rate, 1), np.minimum(1 + CATCH_UP, 2 - self.clock), rate)
        self.clock = self.clock + rate
        due = []
        while (moving := self.clock > 1).any():
            self.clock = np.where(moving, self.clock - 1, self.clock)
            due.append(moving)
        return due

    def push(self, pose: Pose, moved: np.ndarray) -> None:
        """Takes the next pose of those who have moved (...); the others keep theirs."""
        row = _row(pose)
        if self._rows is None:
            self._rows = np.stack([row] * 3)
        elif moved.all():
            self._rows = np.concatenate([self._rows[1:], row[None]])
        else:
            self._rows = self._rows.copy()
            self._rows[:2, moved] = self._rows[1:, moved]
            self._rows[2, moved] = row

    def pose(self) -> Pose:
        """Where the motion is now."""
        assert self._rows is not None
        c = self.clock
        if (c == 1).all():
            return _pose(self._rows[2])
        rows = self._rows.copy()
        angles, turns = rows[..., ANGLES], _rotations(rows)
        angles[:] = angles[2] + rot.wrap_angle(angles - angles[2])
        turns *= np.where(np.vecdot(turns, turns[2])[..., None] < 0, -1.0, 1.0)
        row = (np.stack([c * (c - 1) / 2, 1 - c * c, c * (c + 1) / 2])[..., None] * rows).sum(axis=0)
        row[..., ROTATIONS] = rot.normalize(_rotations(row)).reshape(*np.shape(c), -1)
        row[..., CONTACTS] = np.clip(row[..., CONTACTS], 0.0, 1.0)
        return _pose(row)


def _row(pose: Pose) -> np.ndarray:
    """The numbers (..., 96) of a pose."""
    rotations = pose.rotations.reshape(*pose.rotations.shape[:-2], -1)
    angles = np.stack([pose.root_facing, pose.phase], axis=-1)
    return np.concatenate([rotations, angles, pose.contacts, pose.root_position, pose.hips], axis=-1)


def _pose(row: np.ndarray) -> Pose:
    """The pose that has these numbers (..., 96)."""
    facing, phase = np.moveaxis(row[..., ANGLES], -1, 0)
    return Pose(
        root_position=row[..., ROOT],
        root_facing=rot.wrap_angle(facing),
        hips=row[..., HIPS],
        rotations=_rotations(row),
        contacts=row[..., CONTACTS],
        phase=phase % (2 * np.pi),
    )


def _rotations(rows: np.ndarray) -> np.ndarray:
    """The quaternions (..., 21, 4) of rows, as a view."""
    return rows[..., ROTATIONS].reshape(*rows.shape[:-1], JOINT_COUNT, 4)
