"""Hands that do not flip: of all axes that a network gives a hand's are the least certain, where captures disagree
most."""

import math

import numpy as np

from sim.body.limb_ik import ARMS
from sim.body.skeleton import PARENTS
from sim.math import rotations as rot
from sim.math.vectors import NOT_YET, before_or_now, limit_length
from sim.motion.clip import FPS

HANDS = ARMS[-1]
FASTEST = 8.0  # radians a second that a hand turns against its forearm; captured ones hardly ever exceed it
_LONGEST = FASTEST / FPS  # radians a frame
_LIKEST = math.cos(_LONGEST / 2)  # what the product of two such quaternions, a frame apart, is at least


class WristLimiter:
    """Keeps hands from turning faster against their forearms than hands do. Any leading axes, of a crowd."""

    STATE = ("turned",)

    def __init__(self) -> None:
        self.turned = NOT_YET  # (..., 2, 4), of the hands against their forearms in the last frame

    def step(self, rotations: np.ndarray) -> np.ndarray:
        """Rotations (..., 21, 4), with hands that follow at FASTEST where they would flip."""
        forearms = rotations[..., PARENTS[HANDS], :]
        wanted = rot.multiply(rot.inverse(forearms), rotations[..., HANDS, :])
        before = before_or_now(self.turned, wanted)
        if (np.abs(np.vecdot(wanted, before)) >= _LIKEST).all():
            self.turned = wanted
            return rotations
        step = rot.to_rotation_vector(rot.multiply(wanted, rot.inverse(before)))
        self.turned = rot.multiply(rot.from_rotation_vector(limit_length(step, _LONGEST)), before)
        result = rotations.copy()
        result[..., HANDS, :] = rot.multiply(forearms, self.turned)
        return result
