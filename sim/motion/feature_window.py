"""The last half second of neutral motion, kept as features so that a frame only adds its own."""

from collections import deque

import numpy as np

from sim.body.pose import Pose
from sim.motion.features import LAYOUT, STRIDE, WINDOW, features_between
from sim.motion.playback_pace import OWN_PACE, Pace

TRAVEL = slice(LAYOUT["root"].start, LAYOUT["root"].start + 2)  # the root's velocity over the floor
TURN = slice(TRAVEL.stop, LAYOUT["root"].stop)  # and its turn rate
SPAN = (WINDOW - 1) * STRIDE + 1  # frames: 31, the current one included


class RingBuffer:
    """Poses go in, the feature window (WINDOW, 21, 15) that ends with the newest comes out; a crowd's with its leading
    axis.

    Until half a second has passed, the first pose stands in for its own past."""

    def __init__(self) -> None:
        self._poses: deque[Pose] = deque(maxlen=STRIDE + 1)
        self._features: deque[np.ndarray] = deque(maxlen=SPAN)

    def push(self, pose: Pose, pace: Pace = OWN_PACE) -> None:
        """Adds the newest pose, made at a pace: velocities are in the controller's own time, as if it had gone at
        its own."""
        self._poses.append(pose)
        while len(self._poses) <= STRIDE:
            self._poses.append(pose)
        feature = features_between(pose, self._poses[0])
        if pace is not OWN_PACE:
            for changing in (LAYOUT["velocity"], TURN):
                feature[..., changing] /= np.asarray(pace.rate)[..., None, None]
            feature[..., TRAVEL] /= np.asarray(pace.travel)[..., None, None]
        self._features.append(feature)
        while len(self._features) < SPAN:
            self._features.append(feature)

    def window(self) -> np.ndarray:
        """(..., WINDOW, 21, 15): every STRIDE-th frame of the last half second, the newest last."""
        samples = np.array(list(self._features)[::STRIDE])
        return samples.swapaxes(0, samples.ndim - 3)
