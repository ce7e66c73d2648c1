"""Which instant of one clip does what an instant of another does: the same step of the gait, found by the feet."""

import numpy as np

from sim.body.skeleton import INDEX
from sim.motion.features import LAYOUT, STRIDE
from sim.motion.thresholds import STANDING_MATCH

ANKLES = [INDEX["LeftFoot"], INDEX["RightFoot"]]
OTHER_FOOT = [2, 3, 0, 1]  # columns of a gait signal with left and right exchanged
LAGS = np.arange(0, 31, 6)  # frames back at which two motions are compared
LAG_WEIGHTS = np.linspace(2.0, 0.5, len(LAGS)) / np.linspace(2.0, 0.5, len(LAGS)).sum()
PACES = (0.7, 0.84, 1.0, 1.2, 1.4)  # a style clip may step this much quicker or slower than the content
SMALLEST_STEP = 0.04  # metres: feet that move less are standing, and their noise is not blown up
TOLERANCE = 0.6  # squared difference of gait signals (0 the same, 2 unrelated) at which a match counts 1 / e
SPEED_TOLERANCE = 0.7  # m/s, likewise for speeds over the floor


def gait_signal(features: np.ndarray) -> np.ndarray:
    """(frames, 4) how far forward and how high each ankle is, in units of the clip's own stride, from (frames, 21, 15).

    Centred and scaled clip by clip, so that a shuffle and a march say the same of the same instant."""
    feet = np.asarray(features[:, ANKLES, LAYOUT["position"]], dtype=np.float32)[..., [2, 1]].reshape(-1, 4)
    stride = np.sqrt(feet.var(axis=0).reshape(2, 2).mean(axis=0))  # left and right alike
    return (feet - feet.mean(axis=0)) / np.tile(np.maximum(stride, SMALLEST_STEP), 2)


def best_match(content: np.ndarray, style: np.ndarray) -> tuple[int, float, float]:
    """Where in a style's gait signal (frames, 4) the last LAGS of a content's (lags, 4) happen best.

    Returns the frame, the pace at which the style clip has to be played, and the squared difference; a style too short
    for any pace gives a difference of infinity."""
    best = (0, 1.0, np.inf)
    for pace in PACES:
        lags = np.round(LAGS * pace).astype(int)
        ends = np.arange(lags[-1], len(style), STRIDE)
        if len(ends):
            apart = ((style[ends[:, None] - lags] - content) ** 2).mean(axis=2) @ LAG_WEIGHTS
            found = apart.argmin()
            if apart[found] < best[2]:
                best = (int(ends[found]), pace, float(apart[found]))
    return best


def closeness(apart: float, content_speed: float, style_speed: float) -> float:
    """How much a match is worth, 0..1: same step, like speeds, both on the move."""
    steps = np.clip(
        (min(content_speed, style_speed) - STANDING_MATCH[0]) / (STANDING_MATCH[1] - STANDING_MATCH[0]), 0, 1
    )
    return float(steps * np.exp(-apart / TOLERANCE - ((content_speed - style_speed) / SPEED_TOLERANCE) ** 2))
