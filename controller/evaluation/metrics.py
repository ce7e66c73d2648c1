"""Measures of steered motion: does it go where the stick says, when, with which feet, within which joint angles.

Pure functions on arrays at 60 frames a second; velocities are (frames, 2) world x, z in metres a second.
"""

import numpy as np

from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.motion.metrics import horizontal_speed
from sim.motion.thresholds import PLANTED, STILL_ROOT

STEADY_SECONDS = 1.0  # the end of a stretch over which its steady velocity is taken
ARRIVED = 0.9  # share of the steady velocity at which a change counts as done


def speed_share(velocity: np.ndarray, desired: np.ndarray) -> float:
    """Mean velocity along the one asked for (2,), as a share of it: 1 is as fast as asked, in the direction asked."""
    return float(velocity.mean(axis=0) @ desired / (desired @ desired))


def direction_error(velocity: np.ndarray, desired: np.ndarray) -> float:
    """Mean angle over the frames, in radians, between the velocity and the one asked for (2,)."""
    return float(np.abs(rot.wrap_angle(rot.yaw_of(velocity) - rot.yaw_of(desired))).mean())


def arrival_time(velocity: np.ndarray, desired: np.ndarray) -> float:
    """Seconds from the first frame, at which (2,) is asked for, until the velocity along it first reaches ARRIVED of
    its mean over the last STEADY_SECONDS; infinite where it ends up not moving that way at all."""
    along = velocity @ desired / np.linalg.norm(desired)
    steady = along[-round(STEADY_SECONDS * FPS) :].mean()
    return float(np.argmax(along >= ARRIVED * steady) / FPS) if steady > STILL_ROOT else float("inf")


def time_until_still(velocity: np.ndarray) -> float:
    """Seconds from the first frame, at which nothing is asked for any more, until the speed is under STILL_ROOT and
    stays; infinite where it never is."""
    return time_until(np.linalg.norm(velocity, axis=1) < STILL_ROOT)


def time_until(holds: np.ndarray) -> float:
    """Seconds from the first of frames (frames,) until it holds in all that follow; infinite where it never does."""
    fails = np.flatnonzero(~holds)
    if not len(fails):
        return 0.0
    return float("inf") if fails[-1] == len(holds) - 1 else float((fails[-1] + 1) / FPS)


def contact_speed(joints: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """Speed over the floor (frames, n) of joints (frames, n, 3) whose contact (frames, n) is over PLANTED, else NaN."""
    return np.where(contacts > PLANTED, horizontal_speed(joints), np.nan)


def depth_under(heights: np.ndarray, level: float) -> np.ndarray:
    """How far (frames,) the lowest of heights (frames, n) is under a level, 0 where it is not."""
    return np.maximum(level - heights.min(axis=1), 0.0)


def drift(points: np.ndarray) -> float:
    """The furthest that points (frames, n) ever are from the first."""
    return float(np.linalg.norm(points - points[0], axis=1).max())


def motion_amplitude(relative: np.ndarray) -> float:
    """Standard deviation of root-relative joint positions (frames, joints, 3), mean over the joints: metres."""
    return float(np.linalg.norm(relative.std(axis=0), axis=-1).mean())


def joint_angles(rotations: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Angles (frames, 21, 3) in radians: each joint's rotation vector against its parent, or the facing for the hips.

    rotations (frames, 21, 4) local, the hips' in world axes; facing (frames,) yaw."""
    own = rotations.copy()
    own[:, 0] = rot.multiply(rot.from_yaw(-facing), rotations[:, 0])
    return rot.to_rotation_vector(own)


def outside(angles: np.ndarray, low: np.ndarray, high: np.ndarray, margin: float) -> np.ndarray:
    """Whether any of the angles (frames, ...) is beyond low .. high (...) by more than the margin: (frames,)."""
    beyond = (angles < low - margin) | (angles > high + margin)
    return np.any(beyond.reshape(len(angles), -1), axis=1)


def spells(holds: np.ndarray, seconds: float) -> list[slice]:
    """The stretches of frames, longer than so many seconds, over which (frames,) holds throughout."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]])))
    return [slice(start, stop) for start, stop in zip(edges[::2], edges[1::2]) if stop - start > seconds * FPS]
