"""Measures of style transfer on motion features and poses: what of a style has arrived, what of the content is kept."""

from typing import Callable

import numpy as np

from sim.body.skeleton import INDEX, JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT
from sim.motion.metrics import jerk

HEIGHT = 1.75  # metres: our skeleton from the soles to the crown
BANDS = (0.5, 1.5, 3.0, 6.0, 12.0)  # Hz, the edges: stride, step, what is quicker than a step, trembling
LEFT, GAP, PROGRESS = 0, 1, 2  # rows of `part_distances`

Statistic = Callable[[np.ndarray], np.ndarray]  # features (frames, 21, 15) -> (21, n)


def mean_pose(features: np.ndarray) -> np.ndarray:
    """(21, 6) each joint's mean orientation (6-D, in the character's own frame) of features (frames, 21, 15)."""
    return features[..., LAYOUT["rotation"]].mean(axis=0)


def motion_amplitude(features: np.ndarray) -> np.ndarray:
    """(21, 6) temporal deviation of each joint's orientation."""
    return features[..., LAYOUT["rotation"]].std(axis=0)


def spectrum(features: np.ndarray, fps: float = FPS) -> np.ndarray:
    """(21, 4) root mean square of each joint's orientation in each of BANDS, which forgives another cadence.

    Give a second or more: shorter motion has no such bands."""
    signal = features[..., LAYOUT["rotation"]]
    window = np.hanning(len(signal) + 2)[1:-1, None, None]
    power = np.abs(np.fft.rfft((signal - signal.mean(axis=0)) * window, axis=0)) ** 2
    power *= 2 / (len(signal) * np.sum(window**2))  # sums to the variance
    band = np.digitize(np.fft.rfftfreq(len(signal), 1 / fps), BANDS)
    return np.stack([np.sqrt(power[band == b].sum(axis=(0, 2))) for b in range(1, len(BANDS))], axis=1)


STATISTICS: dict[str, Statistic] = {"mean_pose": mean_pose, "motion_amplitude": motion_amplitude, "spectrum": spectrum}


def part_distances(output: np.ndarray, content: np.ndarray, style: np.ndarray) -> np.ndarray:
    """How far a statistic (21, n) of the content has come to the style's, part by part: (3, 5).

    Rows: LEFT |output - style|; GAP |content - style|; PROGRESS, how far the output went along the straight way. Summed
    over many pairs they give shares that little gaps do not blow up."""

    def length(a: np.ndarray) -> np.ndarray:
        return np.sqrt(np.bincount(PART_OF_JOINT, np.sum(a * a, axis=1)))

    direction, progress = style - content, output - content
    gap = length(direction)
    return np.stack(
        [
            length(output - style),
            gap,
            np.bincount(PART_OF_JOINT, np.sum(progress * direction, axis=1)) / np.maximum(gap, 1e-9),
        ]
    )


def shares(gaps: np.ndarray) -> dict[str, dict[str, float]]:
    """Part -> `closed`, 1 - what is left / what there was, and `progress`, the share of the way along the gap, from
    `part_distances`."""
    gap = np.maximum(gaps[GAP], 1e-9)
    gap_closed, progress = 1 - gaps[LEFT] / gap, gaps[PROGRESS] / gap
    return {part: {"closed": float(c), "progress": float(g)} for part, c, g in zip(PART_NAMES, gap_closed, progress)}


def joint_error(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance of joints (frames, 21, 3) in metres."""
    return float(np.linalg.norm(a - b, axis=-1).mean())


def geodesic(a: np.ndarray, b: np.ndarray) -> float:
    """Mean angle in radians between local joint rotations (..., 4): the content preservation of Guo et al. 2024, Sec.
    4."""
    return float(np.linalg.norm(rot.to_rotation_vector(rot.multiply(rot.inverse(a), b)), axis=-1).mean())


def joint_displacement(output: np.ndarray, content: np.ndarray) -> np.ndarray:
    """(21,) root mean squared displacement of joints (frames, 21, 3) relative to the hips, over the body's height
    (Table 1)."""
    hips = INDEX["Hips"]
    apart = (output - output[:, [hips]]) - (content - content[:, [hips]])
    return np.sqrt(np.sum(apart**2, axis=-1).mean(axis=0)) / HEIGHT


def by_part(per_joint: np.ndarray) -> dict[str, float]:
    """Part -> mean over its joints of (21,); the hips, which `joint_displacement` is relative to, are left out."""
    joints = np.arange(JOINT_COUNT) != INDEX["Hips"]
    return {part: float(per_joint[joints & (PART_OF_JOINT == i)].mean()) for i, part in enumerate(PART_NAMES)}


def jerk_ratio(output: np.ndarray, content: np.ndarray, root: np.ndarray, step: int = 1) -> float:
    """Mean jerk of joints (frames, 21, 3) over the content's, about the same root (frames, 3), looking at every step-th
    frame.

    Motion captured at 30 Hz has corners at 60, which a step of 2 goes around."""
    ours, theirs = (np.nanmean(jerk(p[::step], root[::step], FPS / step)) for p in (output, content))
    return float(ours / theirs)
