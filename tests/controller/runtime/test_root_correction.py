"""The root and the feet that stand: who follows whom."""

import numpy as np
import pytest

from controller.runtime.root_correction import SHARE, RootCorrection
from sim.body.skeleton import CONTACT_JOINTS, JOINT_COUNT


def slid(contacts, frames: int = 40, speed: float = 0.01) -> np.ndarray:
    """The root's last step, where it goes forward by `speed` a frame and the feet stay behind it by nothing."""
    root_correction, positions = RootCorrection(), np.zeros((JOINT_COUNT, 3))
    for _ in range(frames):
        root = root_correction.step(np.array([0.0, speed, 0.0]), positions, np.asarray(contacts, float))
    return root


def test_feet_that_are_dragged_along_hold_the_root_back():
    np.testing.assert_allclose(slid([1, 1, 0, 0]), [0, 0.01 * (1 - SHARE), 0], atol=1e-6)


def test_feet_in_the_air_tell_nothing():
    np.testing.assert_array_equal(slid([0.1, 0.2, 0.0, 0.3]), [0, 0.01, 0])


def test_feet_that_stand_while_the_root_passes_over_them_change_nothing():
    root_correction, positions = RootCorrection(), np.zeros((JOINT_COUNT, 3))
    turn, step = 0.02, np.array([0.003, 0.02, 0.02])
    place = np.array([0.1, 0.0, 0.4])
    for _ in range(30):
        positions[CONTACT_JOINTS] = place
        root = root_correction.step(step, positions, np.ones(4))
        x, z = place[0] - step[0], place[2] - step[1]  # seen from the next root frame
        place = np.array([np.cos(turn) * x - np.sin(turn) * z, 0.0, np.sin(turn) * x + np.cos(turn) * z])
    np.testing.assert_allclose(root, step, atol=1e-9)
    assert root[2] == pytest.approx(turn)
