"""Euler angles: they tell the rotation, and run on where a decomposition alone would jump."""

import numpy as np
import pytest

from sim.math import euler
from sim.math import rotations as rot

ORDERS = ("ZXY", "XYZ", "YZX", "ZYX", "XYX")


def sweep(frames: int = 200) -> np.ndarray:
    """(frames, 3) smooth angles whose middle one passes far beyond both ends of a decomposition's range."""
    t = np.linspace(0, 1, frames)[:, None]
    return np.array([20.0, -170.0, 10.0]) + t * [60.0, 347.0, -90.0]


@pytest.mark.parametrize("order", ORDERS)
def test_angles_run_on_and_tell_the_rotation(order):
    rotations = rot.from_euler(order, sweep())
    angles = euler.continuous(order, rotations)
    back = rot.from_euler(order, angles)
    assert np.abs(np.sum(back * rotations, axis=-1)).min() > 1 - 1e-9
    assert np.abs(np.diff(angles, axis=0)).max() < 5


@pytest.mark.parametrize("order", ORDERS)
def test_from_the_first_angles_on_they_are_the_very_ones(order):
    angles = sweep()
    np.testing.assert_allclose(euler.continuous(order, rot.from_euler(order, angles), angles[0]), angles, atol=1e-6)


@pytest.mark.parametrize("order", ORDERS)
def test_in_gimbal_lock_the_first_angle_stays(order):
    middle = 0.0 if order[0] == order[2] else 90.0
    wanted = np.array([[40.0, middle - 5, 10.0], [40.0, middle, 10.0], [40.0, middle, 30.0], [40.0, middle + 5, 30.0]])
    np.testing.assert_allclose(euler.continuous(order, rot.from_euler(order, wanted), wanted[0]), wanted, atol=1e-4)


def test_rotations_locked_throughout_are_told_all_the_same():
    rotations = rot.from_euler("ZXY", np.array([[10.0, 90.0, 0.0], [20.0, 90.0, 0.0]]))
    back = rot.from_euler("ZXY", euler.continuous("ZXY", rotations))
    assert np.abs(np.sum(back * rotations, axis=-1)).min() > 1 - 1e-9
