"""A whole clip through a network that sees windows: overlapping windows, their outputs faded into each other."""

from typing import Callable

import numpy as np

from sim.motion.features import STRIDE

HOP = 3  # frames between windows; odd, so that they see the even and the odd frames in turn
BATCH = 64  # windows


def evaluate_overlapping(
    features: np.ndarray, samples: int, evaluate: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """(k, frames, a, b) from features (frames, 21, 15) at 60 Hz.

    ask: windows (n, samples, 21, 15) at 30 Hz -> k motions of each, (k, n, samples, a, b), which need not be features.
    A clip shorter than a window is held at its end."""
    frames, span = len(features), (samples - 1) * STRIDE
    padded = np.concatenate([features, features[-1:].repeat(max(span + 2 - frames, 0), axis=0)])
    last = len(padded) - 1 - span
    starts = np.unique([0, 1, *range(0, last, HOP), last - 1, last])
    total: np.ndarray | None = None
    weights = np.zeros((len(padded), 1, 1))
    taper = np.hanning(samples + 2)[1:-1, None, None]
    for some in np.array_split(starts, -(-len(starts) // BATCH)):
        seen = some[:, None] + STRIDE * np.arange(samples)
        motions = evaluate(padded[seen])
        if total is None:
            total = np.zeros((len(motions), len(padded), *motions.shape[3:]))
        for motion, output in zip(total, motions):
            for at, window in zip(seen, output):
                motion[at] += window * taper
        for at in seen:
            weights[at] += taper
    assert total is not None  # a clip has a window
    return (total / weights)[:, :frames]
