"""Vectors in the world: its axes, what of a vector lies along the floor, vectors kept to a length, and vectors kept
from the last frame."""

import numpy as np

from sim.math import rotations as rot

LEFT, UP, FORWARD = np.eye(3)  # the character's, at yaw 0
FLOOR = LEFT + FORWARD  # a vector times this has lost its height
NOT_YET = np.full((), np.nan)  # what is kept of the last frame before there was one


def limit_length(vectors: np.ndarray, longest: float) -> np.ndarray:
    """Vectors (..., n) no longer than `longest`, their directions kept."""
    return vectors * np.minimum(1.0, longest / np.maximum(rot.length(vectors), 1e-9))


def before_or_now(before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """What was kept of the last frame (...), or, where that is NOT_YET, what this one has (...)."""
    return np.where(np.isnan(before), now, before)
