"""The root goes with the planted feet: what they slide in a frame, the root takes back in part."""

import numpy as np

from controller.runtime.trajectory import rotate_2d
from sim.body.skeleton import CONTACT_JOINTS
from sim.math.easing import ramp
from sim.math.springs import decay
from sim.math.vectors import NOT_YET, before_or_now
from sim.motion.clip import FPS
from sim.motion.thresholds import ROOT_CARRIED

SHARE = 0.7  # of the slide that the root takes back; the foot lock sees to the rest
HALFLIFE = 0.03  # seconds that the slide is smoothed over


class RootCorrection:
    """A network's root and feet never agree quite; where a foot stands, the foot is right. Any leading axes, of a
    crowd."""

    STATE = "feet", "slide"

    def __init__(self) -> None:
        self.feet = NOT_YET  # (..., 4, 2) of the last frame, in its root frame
        self.slide = np.zeros(2)

    def step(self, root: np.ndarray, positions: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """The root's step (..., 3): sideways, forward, turn; with the slide taken back. positions (..., 21, 3),
        contacts (..., 4)."""
        feet = positions[..., CONTACT_JOINTS, ::2]
        now = root[..., None, :2] + rotate_2d(feet, root[..., 2])  # where they are in the root frame of the last frame
        held = ramp(contacts, *ROOT_CARRIED)
        moved = now - before_or_now(self.feet, now)
        weight = held * (held.max(axis=-1) / np.maximum(held.sum(axis=-1), 1e-9))[..., None]
        self.feet = feet
        # numpy's types leave the axis out
        slide = np.vecdot(weight[..., None], moved, axis=-2)  # type: ignore[call-overload]
        self.slide = self.slide + (slide - self.slide) * (1 - decay(HALFLIFE, 1 / FPS))
        result = root.copy()
        result[..., :2] -= SHARE * self.slide
        return result
