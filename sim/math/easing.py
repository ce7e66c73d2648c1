"""Ramps: how far a value is on its way from one bound to another, 0 before and 1 past them, straight or eased."""

import numpy as np


def ramp(value: np.ndarray, low: float, high: float) -> np.ndarray:
    """0..1 (...) in a straight line from low to high, for values (...)."""
    return np.minimum(np.maximum((value - low) / (high - low), 0.0), 1.0)  # on few numbers much quicker than np.clip


def smooth_step(value: np.ndarray, low: float, high: float) -> np.ndarray:
    """0..1 (...) that leaves low and comes to high gently, for values (...)."""
    t = ramp(value, low, high)
    return t * t * (3 - 2 * t)
