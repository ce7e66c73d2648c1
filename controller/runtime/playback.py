"""Playback at another rate than the network's own: poses in between, by a parabola through the last three."""

import numpy as np

from sim.body.pose import PLACES, Pose
from sim.body.skeleton import JOINT_COUNT
from sim.math import rotations as rot

CATCH_UP = 0.02  # frames a frame by which a motion that is played at its own rate again comes back to whole frames
# In `Pose.flat`. The angles are two numbers: the root's facing, and the phase, which is the last of all.
ROTATIONS, CONTACTS, FACING, PHASE = (PLACES[name] for name in ("rotations", "contacts", "root_facing", "phase"))
ANGLES = slice(FACING.start, None, PHASE.start - FACING.start)


class Playback:
    """How far between its last two poses a motion is. Any leading axes, of a crowd."""

    def __init__(self, crowd: tuple[int, ...] = ()) -> None:
        self.clock = np.ones(crowd)  # 0..1 from the last pose but one to the last
        self._last: np.ndarray | None = None  # (3, ..., FLAT_SIZE) the last three poses

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
        if self._last is None:
            self._last = np.stack([pose.flat] * 3)
        elif moved.all():
            self._last = np.concatenate([self._last[1:], pose.flat[None]])
        else:
            self._last = self._last.copy()
            self._last[:2, moved] = self._last[1:, moved]
            self._last[2, moved] = pose.flat

    def pose(self) -> Pose:
        """Where the motion is now."""
        assert self._last is not None
        c, poses = self.clock, self._last
        if (c == 1).all():
            return Pose.of_flat(poses[2])
        angles, turns = poses[..., ANGLES], _rotations(poses)
        signs = np.where(np.vecdot(turns, turns[2])[..., None] < 0, -1.0, 1.0)
        poses = poses.copy()
        poses[..., ANGLES] = angles[2] + rot.wrap_angle(angles - angles[2])
        poses[..., ROTATIONS] = (turns * signs).reshape((*poses.shape[:-1], -1))
        first, middle, last = (
            np.asarray(weight)[..., None] for weight in (c * (c - 1) / 2, 1 - c * c, c * (c + 1) / 2)
        )
        now = first * poses[0] + middle * poses[1] + last * poses[2]
        now[..., ROTATIONS] = rot.normalize(_rotations(now)).reshape((*now.shape[:-1], -1))
        now[..., CONTACTS] = np.minimum(np.maximum(now[..., CONTACTS], 0.0), 1.0)
        now[..., PHASE] = now[..., PHASE] % (2 * np.pi)
        now[..., FACING] = rot.wrap_angle(now[..., FACING])
        return Pose.of_flat(now)


def _rotations(poses: np.ndarray) -> np.ndarray:
    """The quaternions (..., 21, 4) of flat poses."""
    return poses[..., ROTATIONS].reshape((*poses.shape[:-1], JOINT_COUNT, 4))
