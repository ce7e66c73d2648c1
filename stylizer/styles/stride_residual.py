"""What of a clip's movement is not locked to the stride: a musician's arms, a sad head.

A network that sees the content's steps alone can make nothing but loops of the step. The rest of a style's movement is
kept as a loop of its own, played in its own time on top."""

import numpy as np

from sim.body.skeleton import INDEX, JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT, STRIDE
from sim.motion.gait import cycle_at, fit_cycle, stride_phase

SHORTEST_LOOP = 2.5  # seconds
LONGEST_LOOP = 16.0  # seconds
SMOOTHING = 1.2  # samples (Gaussian sigma): what is quicker than 5 Hz is no movement but noise
CROSS_FADE = 0.6  # seconds in which the loop's end goes over into its beginning
SURE = 0.3  # what the mean of a joint's two axes must span, of 1, to say how the joint is turned
PHASES = 24  # of a stride that are looked at for that
# Legs and hips carry the body: what they do is the gait's alone.
JOINTS = np.flatnonzero((PART_OF_JOINT >= PART_NAMES.index("spine")) & (np.arange(JOINT_COUNT) != INDEX["Hips"]))


def stride_residual(features: np.ndarray) -> np.ndarray | None:
    """A loop (T, 21, 3) at 30 Hz of rotation vectors in the character's frame, from features (frames, 21, 15) at 60 Hz:
    what turns the movement that repeats with each stride into the captured one. None for a clip too short for a
    loop."""
    if len(features) < SHORTEST_LOOP * FPS:
        return None
    axes, phase = features[..., LAYOUT["rotation"]], stride_phase(features)
    locked = (
        stride_locked_part(axes, None) if phase is None else cycle_at(rest_unsure_joints(fit_cycle(axes, phase)), phase)
    )
    turns = rot.to_rotation_vector(
        rot.multiply(rot.from_6d(axes[:, JOINTS]), rot.inverse(rot.from_6d(locked[:, JOINTS])))
    )
    loop = np.zeros((len(features), JOINT_COUNT, 3))
    loop[:, JOINTS] = rot.unwrap(turns)
    from scipy.ndimage import gaussian_filter1d  # the live loop imports this file, and reads no clip

    return gaussian_filter1d(
        _closed(loop[::STRIDE][: round(LONGEST_LOOP * FPS / STRIDE)]), SMOOTHING, axis=0, mode="wrap"
    )


def stride_locked_part(signal: np.ndarray, phase: np.ndarray | None) -> np.ndarray:
    """Of a signal (frames, ...) what repeats with the stride phase (frames,); its mean where there is none."""
    if phase is None:
        return np.broadcast_to(signal.mean(axis=0), signal.shape)
    return cycle_at(fit_cycle(signal, phase), phase)


def rest_unsure_joints(cycle: np.ndarray) -> np.ndarray:
    """The cycle (coefficients, 21, 6) of joints' axes, at rest for joints whose mean turn is unsure at some phase.

    The mean of turns that lie far apart has short axes. Where they cancel, the joint would turn over within a frame."""
    axes = cycle_at(cycle, np.linspace(0, 2 * np.pi, PHASES, endpoint=False))
    unsure = (rot.length(rot.cross(axes[..., :3], axes[..., 3:]))[..., 0] < SURE).any(axis=0)
    result = cycle.copy()
    result[1:, unsure] = 0.0
    result[0, unsure] = rot.to_6d(rot.from_6d(cycle[0, unsure]))
    return result


def _closed(loop: np.ndarray) -> np.ndarray:
    """A loop (T', ...) without a seam: the end of (T, ...) is faded over its beginning."""
    count = round(CROSS_FADE * FPS / STRIDE)
    share = (np.arange(count) + 0.5) / count
    share = share[:, None, None] ** 2 * (3 - 2 * share[:, None, None])
    result = loop[:-count].copy()
    result[:count] = share * loop[:count] + (1 - share) * loop[-count:]
    return result


def play_residual(loop: np.ndarray, frame: int) -> np.ndarray:
    """A loop (T, ...) at 30 Hz at a frame of 60 Hz; between two samples by a cubic (Catmull and Rom 1974)."""
    sample, between = divmod(frame, STRIDE)
    if not between:
        return loop[sample % len(loop)]
    a, b, c, d = (loop[(sample + offset) % len(loop)] for offset in (-1, 0, 1, 2))
    return (9 * (b + c) - (a + d)) / 16
