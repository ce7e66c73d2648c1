"""Playback at another rate than the network's own: poses in between, by a parabola through the last three."""

from dataclasses import fields

import numpy as np

from controller.runtime.jump import Jump
from sim.body.pose import Pose
from sim.math import rotations as rot

CATCH_UP = 0.02  # frames a frame by which a motion that is played at its own rate again comes back to whole frames


class Playback:
    """How far between its last two poses a motion is. Any leading axes, of a crowd."""

    def __init__(self, crowd: tuple[int, ...] = ()) -> None:
        self.clock = np.ones(crowd)  # 0..1 from the last pose but one to the last
        self._poses: list[Pose] = []  # the last three

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
        if not self._poses:
            self._poses = [pose] * 3
        elif moved.all():
            self._poses = [*self._poses[1:], pose]
        elif moved.any():
            self._poses = [_where(moved, after, before) for before, after in zip(self._poses, [*self._poses[1:], pose])]

    def pose(self) -> Pose:
        """Where the motion is now."""
        first, middle, last = self._poses
        if (self.clock == 1).all():
            return last
        c = self.clock
        weights = c * (c - 1) / 2, 1 - c * c, c * (c + 1) / 2

        def between(a: np.ndarray | float, b: np.ndarray | float, z: np.ndarray | float) -> np.ndarray:
            shape = *np.shape(c), *[1] * (np.ndim(z) - np.ndim(c))
            return sum((np.reshape(w, shape) * value for w, value in zip(weights, (a, b, z))), np.zeros(()))

        def turning(angles: list[np.ndarray | float]) -> list[np.ndarray | float]:
            return [angles[-1] + rot.wrap_angle(angle - angles[-1]) for angle in angles]

        poses = [first, middle, last]
        signs = [np.where(np.vecdot(p.rotations, last.rotations)[..., None] < 0, -1.0, 1.0) for p in poses]
        result = Pose(
            root_position=between(*(p.root_position for p in poses)),
            root_facing=rot.wrap_angle(between(*turning([p.root_facing for p in poses]))),
            hips=between(*(p.hips for p in poses)),
            rotations=rot.normalize(between(*(s * p.rotations for s, p in zip(signs, poses)))),
            contacts=np.clip(between(*(p.contacts for p in poses)), 0.0, 1.0),
            phase=between(*turning([p.phase for p in poses])) % (2 * np.pi),
        )
        return _where(c == 1, last, result)


def _where(which: np.ndarray, one: Pose, other: Pose) -> Pose:
    """Some characters (...) of one pose, the rest of another."""
    return Pose(
        *(
            np.where(np.reshape(which, (*np.shape(which), *[1] * (np.ndim(a) - np.ndim(which)))), a, b)
            for a, b in ((getattr(one, f.name), getattr(other, f.name)) for f in fields(Pose))
        )
    )


def keep(before: object, after: object, moved: np.ndarray) -> None:
    """Gives the characters of a crowd who have not moved (n,) the state that they had before, array by array."""
    for name, value in vars(after).items():
        if isinstance(value, Jump):
            keep(getattr(before, name), value, moved)
        if isinstance(value, np.ndarray) and value.shape[:1] == moved.shape:
            which = moved.reshape(len(moved), *[1] * (value.ndim - 1))
            setattr(after, name, np.where(which, value, getattr(before, name)))
