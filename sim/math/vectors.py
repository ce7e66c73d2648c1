"""Vectors in the world: its axes, what of a vector lies along the floor, and vectors kept to a length."""

import numpy as np

from sim.math import rotations as rot

LEFT, UP, FORWARD = np.eye(3)  # the character's, at yaw 0
FLOOR = LEFT + FORWARD  # a vector times this has lost its height


def limit_length(vectors: np.ndarray, longest: float) -> np.ndarray:
    """Vectors (..., n) no longer than `longest`, their directions kept."""
    return vectors * np.minimum(1.0, longest / np.maximum(rot.length(vectors), 1e-9))
