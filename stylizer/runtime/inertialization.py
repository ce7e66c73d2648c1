"""Switches without a jump: the gap between what was drawn and what is asked now is closed by a spring (Bollo 2018).

The gap of each joint is a rotation, chosen once, the shorter way, when it opens, and kept until it is closed: so an arm
that has half a circle to go swings there along one arc."""

import numpy as np

from sim.body.skeleton import JOINT_COUNT
from sim.math import rotations as rot
from sim.math.springs import soft_spring_step
from sim.motion.clip import FPS

HALFLIFE = 0.22  # seconds in which half of a gap is closed
SETTLED = 1e-5  # radians, metres
DT = 1 / FPS


class Inertializer:
    """Rotations (..., 21, 4) and a shift (..., 3) without jumps. Any leading axes, of a crowd."""

    def __init__(self, crowd: tuple[int, ...] = ()) -> None:
        # rotation vectors and the shift: where, how fast, how much faster
        self.offset = np.zeros((3, *crowd, JOINT_COUNT + 1, 3))
        self._turns = np.tile(rot.IDENTITY, (*crowd, JOINT_COUNT, 1))  # of the last frame
        self._shift = np.zeros((*crowd, 3))
        self._rate = np.zeros((*crowd, JOINT_COUNT + 1, 3))

    def step(self, turns: np.ndarray, shift: np.ndarray, jumping: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What is to be drawn where turns and shift are asked; jumping (..., 22): joints, and the shift, whose gap is
        to be told anew."""
        if jumping.any():
            offset = np.concatenate(
                [
                    rot.to_rotation_vector(rot.multiply(self._turns, rot.inverse(turns))),
                    (self._shift - shift)[..., None, :],
                ],
                axis=-2,
            )
            for state, fresh in zip(self.offset, (offset, self._rate, 0.0 * offset)):
                np.copyto(state, fresh, where=jumping[..., None])
        if self.offset.any():
            where, rate, change = self.offset
            self.offset = np.array(soft_spring_step(where, rate, change, 0.0, HALFLIFE, DT))
            if np.abs(self.offset).max() < SETTLED:
                self.offset[:] = 0.0
            offset = self.offset[0]
            turns = rot.multiply(rot.from_rotation_vector(offset[..., :-1, :]), turns)
            shift = shift + offset[..., -1, :]
        self._rate = (
            np.concatenate(
                [
                    rot.to_rotation_vector(rot.multiply(turns, rot.inverse(self._turns))),
                    (shift - self._shift)[..., None, :],
                ],
                axis=-2,
            )
            / DT
        )
        self._turns, self._shift = turns, shift
        return turns, shift
