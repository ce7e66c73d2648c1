"""Foot contacts of recorded motion: which of ankle and toe, left and right, stands on the floor in each frame."""

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from sim.clip import Clip
from sim.skeleton import ANKLE_HEIGHT, CONTACT_JOINTS, TOE_HEIGHT

HEIGHT_ALLOWANCE = 0.05  # metres over the height that the joint has while the foot is flat
SPEED_LIMIT = 0.55  # metres a second; planted feet, retargeted, move 0.02 to 0.07 walking and up to 0.5 running
SMOOTHING = 0.05  # seconds


def foot_contacts(clip: Clip) -> np.ndarray:
    """Contacts (frames, 4), 0 or 1, for left foot, left toe, right foot, right toe of a grounded clip.

    A joint is in contact while it is low and slow; single frames that disagree with their neighbours are voted away."""
    joints = clip.positions()[:, CONTACT_JOINTS]
    velocity = np.gradient(joints, 1 / clip.fps, axis=0) if len(clip) > 1 else np.zeros_like(joints)
    window = max(1, round(SMOOTHING * clip.fps)) | 1
    speed = np.linalg.norm(uniform_filter1d(velocity, window, axis=0, mode="nearest"), axis=-1)
    flat = np.array([ANKLE_HEIGHT, TOE_HEIGHT] * 2)
    touching = (joints[..., 1] < flat + HEIGHT_ALLOWANCE) & (speed < SPEED_LIMIT)
    return median_filter(touching.astype(float), size=(window, 1), mode="nearest")
