"""Hands follow as they are asked to, unless they would flip."""

import numpy as np
import pytest

from controller.runtime.wrist_limiter import FASTEST, HANDS, WristLimiter
from sim.body.skeleton import INDEX, JOINT_COUNT
from sim.math import rotations as rot
from sim.motion.clip import FPS


def bent(angle: float) -> np.ndarray:
    """The rest pose with both hands turned about the vertical against their forearms."""
    rotations = np.tile(rot.IDENTITY, (JOINT_COUNT, 1))
    rotations[HANDS] = rot.from_yaw(angle)
    return rotations


def test_a_hand_that_turns_as_hands_do_is_left_alone():
    wrists = WristLimiter()
    for angle in np.linspace(0.0, 0.5, 60):
        pose = bent(angle)
        assert wrists.step(pose) is pose


def test_a_flip_is_followed_no_faster_than_a_hand_turns_and_taken_back_unseen():
    wrists = WristLimiter()
    wrists.step(bent(0.0))
    flipped = wrists.step(bent(2.5))
    turned = rot.to_rotation_vector(flipped[HANDS])
    assert np.linalg.norm(turned, axis=-1) == pytest.approx(FASTEST / FPS)
    np.testing.assert_array_equal(np.delete(flipped, HANDS, axis=0), np.delete(bent(0.0), HANDS, axis=0))
    np.testing.assert_allclose(wrists.step(bent(0.0))[HANDS], bent(0.0)[HANDS], atol=1e-9)
    for _ in range(FPS):
        late = wrists.step(bent(2.5))
    np.testing.assert_allclose(np.abs(np.sum(late * bent(2.5), axis=-1)), 1.0, atol=1e-9)


def test_it_is_the_forearm_that_a_hand_turns_against():
    wrists, pose = WristLimiter(), bent(0.2)
    wrists.step(pose)
    whole = rot.multiply(rot.from_yaw(3.0), pose)  # the body spins, hands and all
    np.testing.assert_array_equal(wrists.step(whole), whole)
    bent_elbows = whole.copy()
    for name in ("LeftForeArm", "LeftHand", "RightForeArm", "RightHand"):
        bent_elbows[INDEX[name]] = rot.multiply(rot.from_yaw(2.0), whole[INDEX[name]])
    np.testing.assert_array_equal(wrists.step(bent_elbows), bent_elbows)
