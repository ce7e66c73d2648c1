"""Hands that do not flip: of all axes that a network answers a hand's are the least certain, where captures disagree most."""

import numpy as np

from sim import rotations as rot
from sim.clip import FPS
from sim.skeleton import INDEX, PARENTS

HANDS = np.array([INDEX["LeftHand"], INDEX["RightHand"]])
FASTEST = 8.0  # radians a second that a hand turns against its forearm; captured ones hardly ever exceed it


class Wrists:
    """Keeps hands from turning faster against their forearms than hands do."""

    def __init__(self) -> None:
        self.turned: np.ndarray | None = None  # (2, 4), of the hands against their forearms in the last frame

    def step(self, rotations: np.ndarray) -> np.ndarray:
        """Rotations (21, 4), with hands that follow at FASTEST where they would flip."""
        forearms = rotations[PARENTS[HANDS]]
        wanted = rot.multiply(rot.inverse(forearms), rotations[HANDS])
        if self.turned is None:
            self.turned = wanted
            return rotations
        step = rot.to_rotation_vector(rot.multiply(wanted, rot.inverse(self.turned)))
        angle = np.sqrt(np.sum(step * step, axis=-1, keepdims=True))
        if (angle <= FASTEST / FPS).all():
            self.turned = wanted
            return rotations
        step *= np.minimum(1.0, FASTEST / FPS / np.maximum(angle, 1e-9))
        self.turned = rot.multiply(rot.from_rotation_vector(step), self.turned)
        result = rotations.copy()
        result[HANDS] = rot.multiply(forearms, self.turned)
        return result
