"""Rotation vectors there and back, from no turn at all to half a circle."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.math import rotations as rot


@pytest.mark.parametrize("angle", [0.0, 1e-20, 1e-9, 1e-3, 1.0, 3.0, np.pi - 1e-9])
def test_rotation_vectors_are_scipys_and_come_back(angle):
    axes = rot.normalize(np.random.default_rng(0).normal(size=(20, 3)))
    turns = rot.from_rotation_vector(angle * axes)
    theirs = rot.from_scipy(Rotation.from_rotvec(angle * axes))
    np.testing.assert_allclose(turns, theirs, atol=1e-15)
    for sign in (1, -1):
        np.testing.assert_allclose(rot.to_rotation_vector(sign * turns), angle * axes, rtol=1e-9, atol=1e-30)


def test_no_turn_is_the_identity_exactly():
    np.testing.assert_array_equal(rot.from_rotation_vector(np.zeros((2, 3))), [rot.IDENTITY] * 2)
    np.testing.assert_array_equal(rot.to_rotation_vector(rot.IDENTITY), 0.0)


def test_a_turn_is_taken_the_nearer_way_round():
    """Whether or not any of those beside it has to be turned about."""
    near, far = np.array([0.0, 3.0, 0.0]), np.array([0.0, -3.0, 0.0])
    np.testing.assert_array_equal(rot.nearest_turn(near, np.array([0.0, 3.3, 0.0])), near)
    both = rot.nearest_turn(np.array([near, far]), np.array([near, [0.0, 3.3, 0.0]]))
    np.testing.assert_allclose(both, [near, [0.0, 2 * np.pi - 3.0, 0.0]])
