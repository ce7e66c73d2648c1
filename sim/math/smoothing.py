"""A smooth curve that meets what it is asked for: the penalised least squares under every correction of whole clips."""

import numpy as np
from scipy.linalg import solveh_banded

SECOND_DIFFERENCE = (1.0, -2.0, 1.0)


def smooth_penalised(
    target: np.ndarray,
    weight: np.ndarray | float,
    stillness: np.ndarray | float,
    fade: float,
    free: np.ndarray | float = 1.0,
) -> np.ndarray:
    """The curve c (frames, ...) of least curvature that is near `target` (frames, ...) where `weight` (frames,) says
    so, goes as target goes where `stillness` (frames - 1,), of each step, says so, and else fades to 0 over about
    `fade` frames.

    Minimizes |c''|^2 + free (c / fade^2)^2 + weight (c - target)^2 + stillness (c' - target')^2 over four frames or
    more; `free` (frames,) in 0..1 is how much of the fading applies."""
    frames = len(target)
    bands = np.zeros((3, frames))  # the upper bands of a symmetric matrix, its diagonal last
    for a, in_row in enumerate(SECOND_DIFFERENCE):
        for b, in_column in enumerate(SECOND_DIFFERENCE[a:], a):
            bands[2 - (b - a), b : frames - 2 + b] += in_row * in_column
    bands[2] += fade**-4 * free + weight
    bands[2, :-1] += stillness
    bands[2, 1:] += stillness
    bands[1, 1:] -= stillness
    pull = (weight * target.T).T
    step = (stillness * np.diff(target, axis=0).T).T
    pull[:-1] -= step
    pull[1:] += step
    return solveh_banded(bands, pull)
