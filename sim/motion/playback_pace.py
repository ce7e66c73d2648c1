"""The pace of styled legs: how fast the controller is to go, at which playback rate, and how far a stride carries the
body."""

from typing import NamedTuple

import numpy as np

from sim.math.springs import spring_step
from sim.motion.clip import FPS

HALFLIFE = 0.25  # seconds in which half of the way to another pace is gone
ARRIVED = 1e-4  # a pace that is as near to the one that is asked is there, much sooner than rounding would decide


class Pace(NamedTuple):
    """Numbers, or arrays (...) of a crowd.

    speed: what the stick's velocity is multiplied by; rate: the controller's playback rate, 1.2 for steps that are a
    fifth quicker; stride: what the root's step is multiplied by, so that it goes as far as the styled legs carry it."""

    speed: np.ndarray | float = 1.0
    rate: np.ndarray | float = 1.0
    stride: np.ndarray | float = 1.0

    @property
    def travel(self) -> np.ndarray | float:
        """What the root's way over the floor is multiplied by in all."""
        return self.rate * self.stride


OWN_PACE = Pace()  # the controller's own


class PaceFollower:
    """Speed and rate on their smooth way to the ones that are asked. Any leading axes, of a crowd."""

    def __init__(self) -> None:
        self.pace, self.change = np.ones(2), np.zeros(2)  # (..., 2): speed and rate, and how fast they change

    def step(self, speed: np.ndarray | float, rate: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """One frame towards them."""
        wanted = np.empty((*np.shape(speed), 2))
        wanted[..., 0], wanted[..., 1] = speed, rate
        self.pace, self.change = spring_step(self.pace, self.change, wanted, HALFLIFE, 1 / FPS)
        # exactly there: a replay without styles is the controller's to the last bit
        there = np.abs(self.pace - wanted).max(axis=-1, keepdims=True) < ARRIVED
        self.pace, self.change = np.where(there, wanted, self.pace), np.where(there, 0.0, self.change)
        return self.pace[..., 0], self.pace[..., 1]
