"""Foot contacts of recorded motion: which of ankle and toe, left and right, stands on the floor in each frame."""

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from sim.body.skeleton import ANKLE_HEIGHT, CONTACT_JOINTS, TOE_HEIGHT
from sim.math.vectors import FLOOR
from sim.motion.clip import Clip
from sim.motion.thresholds import TOUCH_SPEED, TOUCH_SPEED_SHARE

# Metres over the height that ankle and toe have while the foot is flat: a heel that has risen more has let go of the
# floor.
HEIGHT_ALLOWANCE = np.array([0.025, 0.03] * 2)
# A planted joint moves slower than so many metres a second and this share of the body's speed: captured toes push off
# while they creep, 0.02 to 0.07 m/s walking and up to 0.8 running.
SMOOTHING = 0.05  # seconds, for feet
BODY_SMOOTHING = 0.3  # seconds, for the hips
FLAT = np.array([ANKLE_HEIGHT, TOE_HEIGHT] * 2)


def foot_contacts(clip: Clip) -> np.ndarray:
    """Contacts (frames, 4), 0 or 1, for left foot, left toe, right foot, right toe of a grounded clip.

    A joint is in contact while it is low and slow; single frames that disagree with their neighbours are voted away."""
    positions = clip.positions()
    joints = positions[:, CONTACT_JOINTS]
    window = max(1, round(SMOOTHING * clip.fps)) | 1
    speed = _speed(joints, window, clip.fps)
    body = _speed(positions[:, 0] * FLOOR, round(BODY_SMOOTHING * clip.fps), clip.fps)
    touching = (joints[..., 1] < FLAT + HEIGHT_ALLOWANCE) & (speed < TOUCH_SPEED + TOUCH_SPEED_SHARE * body[:, None])
    return median_filter(touching.astype(float), size=(window, 1), mode="nearest")


def _speed(points: np.ndarray, window: int, fps: float) -> np.ndarray:
    """Speed (frames, ...) of points (frames, ..., 3), their velocity averaged over a window of frames."""
    velocity = np.gradient(points, 1 / fps, axis=0) if len(points) > 1 else np.zeros_like(points)
    return np.linalg.norm(uniform_filter1d(velocity, max(1, window), axis=0, mode="nearest"), axis=-1)
