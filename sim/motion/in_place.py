"""Clips that walk in place, as on a treadmill: their travel restored, and short loops of them repeated."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from sim.body.skeleton import CONTACT_JOINTS
from sim.math import rotations as rot
from sim.math.vectors import FLOOR
from sim.motion.clip import Clip, root_frame
from sim.motion.contacts import FLAT
from sim.motion.thresholds import STAND_SPEED

FLOOR_PERCENTILE = 20  # of the lowest joint's height over time: about the middle of a step, also of a run
NEAR_FLOOR = 0.02  # metres over the floor at which a joint of a foot counts e^-1 times as much as on it
STEADY = 0.5  # share of their common velocity by which planted joints may differ from it before they count less
PLANTED_SHARE = 0.4  # of what is near the floor that has to move at about one velocity: else nobody walks
SMOOTHING = 0.04  # seconds (Gaussian sigma) over which the velocity of the planted foot is averaged
LITTLE = 1e-3  # weight of the mean velocity against a planted foot's own: it decides while both feet are in the air
LOOP_GAP = 0.1  # radians, mean over the joints, between the first and the last pose of a loop


def restore_travel(clip: Clip, seconds: float = 0.0) -> Clip:
    """The clip with the travel that was taken out of it: the body moves so that the planted foot stands still.

    A loop is then repeated until it lasts at least `seconds`. Returns the same object for a clip whose root travels,
    and for one whose feet do not slide steadily under the body: it stands, shifts its weight or steps on the spot. The
    first frame's place on the floor and every pose are kept."""
    if len(clip) < 2:
        return clip
    positions = clip.positions()
    root = root_frame(positions, clip.fps).positions
    travels = np.linalg.norm(np.diff(root, axis=0), axis=-1).mean() * clip.fps > STAND_SPEED
    velocity, weight, slide = _planted_velocity(positions, clip.fps)
    if travels or slide is None:
        return clip
    sigma = SMOOTHING * clip.fps
    pull = gaussian_filter1d(velocity * weight[:, None], sigma, axis=0, mode="nearest") + LITTLE * slide
    velocity = pull / (gaussian_filter1d(weight, sigma, mode="nearest")[:, None] + LITTLE)
    steps = -(velocity[1:] + velocity[:-1]) / (2 * clip.fps)
    travel = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return _repeat_loop(replace(clip, hips=clip.hips + travel).grounded(), seconds)


def _repeat_loop(clip: Clip, seconds: float) -> Clip:
    """A clip that ends in its first pose, repeated until it lasts at least `seconds`; one that does not, as it is.

    Each round goes on where the one before ended; the pose that the first and the last frame share is played once."""
    rounds = int(np.ceil(seconds * clip.fps / (len(clip) - 1)))
    apart = rot.multiply(rot.inverse(clip.rotations[0]), clip.rotations[-1])
    if rounds < 2 or np.linalg.norm(rot.to_rotation_vector(apart), axis=-1).mean() > LOOP_GAP:
        return clip
    onward = (clip.hips[-1] - clip.hips[0]) * FLOOR
    hips = np.concatenate([clip.hips[:-1] + onward * each for each in range(rounds)])
    return replace(clip, hips=hips, rotations=rot.make_continuous(np.tile(clip.rotations[:-1], (rounds, 1, 1))))


def _planted_velocity(positions: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """From joint positions (frames, 21, 3): the velocity over the floor (frames, 3), in metres a second, of the planted
    joints of the feet; how surely one is planted (frames,), 0 to 1; and their common velocity (3,), None where they
    have none.

    Planted is what is low and goes with the rest that is low: some swinging feet brush the floor."""
    feet = positions[:, CONTACT_JOINTS]
    height = feet[..., 1] - FLAT
    height = np.maximum(height - np.percentile(height.min(axis=1), FLOOR_PERCENTILE), 0.0)
    low = np.exp(-height / NEAR_FLOOR) + 1e-9
    velocity = np.gradient(feet, 1 / fps, axis=0) * FLOOR
    slide = np.array([_weighted_median(axis.ravel(), low.ravel()) for axis in np.moveaxis(velocity, -1, 0)])
    speed = np.linalg.norm(slide)
    planted = low * np.exp(-(((velocity - slide) / (STEADY * speed + 1e-9)) ** 2).sum(axis=-1)) + 1e-12
    steady = speed > STAND_SPEED and planted.sum() > PLANTED_SHARE * low.sum()
    mean = np.einsum("fj,fjc->fc", planted, velocity) / planted.sum(axis=1, keepdims=True)
    return mean, planted.max(axis=1), slide if steady else None


def _weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    """The value (of n) under which half of the weight (n,) lies."""
    order = values.argsort()
    total = weights[order].cumsum()
    return float(values[order][np.searchsorted(total, total[-1] / 2)])
