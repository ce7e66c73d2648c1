"""Switches without a jump: the gap between what was drawn and what is asked now is closed by a spring (Bollo 2018).

The gap of each joint is a rotation, chosen once, the shorter way, when it opens, and kept until it is closed: so an arm
that has half a circle to go swings there along one arc."""

import numpy as np

from sim.body.skeleton import JOINT_COUNT
from sim.math import rotations as rot
from sim.math.springs import response, soft_spring_step
from sim.motion.clip import FPS

HALFLIFE = 0.22  # seconds in which half of a gap is closed
SETTLED = 1e-5  # radians, metres
DT = 1 / FPS
CLOSE = response(soft_spring_step, HALFLIFE, DT)  # (3, 3) a frame of the spring


class Inertializer:
    """Rotations (..., 21, 4) and a shift (..., 3) without jumps. Any leading axes, of a crowd."""

    def __init__(self, crowd: tuple[int, ...] = ()) -> None:
        # rotation vectors and the shift: where, how fast, how much faster
        self.offset = np.zeros((3, *crowd, JOINT_COUNT + 1, 3))
        at_rest = np.tile(rot.IDENTITY, (*crowd, JOINT_COUNT, 1)), np.zeros((*crowd, 3))
        self._before, self._last = at_rest, at_rest  # turns and shift, as they were drawn in the last two frames

    def step(self, turns: np.ndarray, shift: np.ndarray, jumping: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What is to be drawn where turns and shift are asked; jumping (..., 22): joints, and the shift, whose gap is
        to be told anew."""
        if jumping.any():
            gap, rate = _apart(self._last, (turns, shift)), _apart(self._last, self._before) / DT
            np.copyto(self.offset, [gap, rate, 0.0 * gap], where=jumping[..., None])
        if self.offset.any():
            self.offset = (CLOSE @ self.offset.reshape(3, -1)).reshape(self.offset.shape)
            if np.abs(self.offset).max() < SETTLED:
                self.offset[:] = 0.0
            offset = self.offset[0]
            turns = rot.multiply(rot.from_rotation_vector(offset[..., :-1, :]), turns)
            shift = shift + offset[..., -1, :]
        self._before, self._last = self._last, (turns, shift)
        return turns, shift


def _apart(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Rotation vectors and shift (..., 22, 3) that lead to one from the other."""
    turns = rot.to_rotation_vector(rot.multiply(one[0], rot.inverse(other[0])))
    return np.concatenate([turns, (one[1] - other[1])[..., None, :]], axis=-2)
