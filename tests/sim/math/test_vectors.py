"""Ramps and vectors kept to a length."""

import numpy as np

from sim.math.easing import ramp, smooth_step
from sim.math.vectors import FLOOR, FORWARD, LEFT, UP, limit_length


def test_ramps_hold_before_and_past_their_bounds():
    values = np.array([0.0, 2.0, 3.0, 4.0, 9.0])
    np.testing.assert_allclose(ramp(values, 2.0, 4.0), [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(smooth_step(values, 2.0, 4.0), [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(smooth_step(np.array([2.01, 3.99]), 2.0, 4.0), [0, 1], atol=1e-4)
    assert ramp(3.5, 4.0, 3.0) == 0.5, "also downwards"


def test_only_what_is_too_long_is_cut_and_keeps_its_direction():
    vectors = np.array([[3.0, 0.0, 4.0], [0.1, 0.2, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(limit_length(vectors, 1.0), [[0.6, 0, 0.8], [0.1, 0.2, 0], [0, 0, 0]])


def test_the_axes_are_right_handed_and_the_floor_is_level():
    np.testing.assert_array_equal(np.cross(LEFT, UP), FORWARD)
    np.testing.assert_array_equal(np.array([1.0, 2.0, 3.0]) * FLOOR, [1, 0, 3])
