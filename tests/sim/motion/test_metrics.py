"""Foot skate, jerk and Frechet distance on motion whose answer is known."""

import numpy as np
import pytest

from sim.body.skeleton import TOE_HEIGHT
from sim.motion.clip import FPS
from sim.motion.features import clip_features
from sim.motion.metrics import (
    SKATE_HEIGHT,
    VELOCITY_SECONDS,
    foot_skate,
    frechet_distance,
    horizontal_speed,
    jerk,
    pose_and_velocity,
)
from tests.support.walker import SPEED, walking_clip


def sliding(height: float, speed: float = 0.5, frames: int = 20) -> np.ndarray:
    """Two toes (frames, 2, 3) so high above where they lie flat, the first sliding, the second still."""
    toes = np.zeros((frames, 2, 3))
    toes[..., 1] = TOE_HEIGHT + height
    toes[:, 0, 0] = speed * np.arange(frames) / FPS
    return toes


@pytest.mark.parametrize(
    "height, weight", [(-0.01, 1.0), (0.0, 1.0), (SKATE_HEIGHT / 2, 2 - 2**0.5), (0.99 * SKATE_HEIGHT, 0.014)]
)
def test_skate_is_the_speed_weighted_by_height(height, weight):
    skate = foot_skate(sliding(height))
    np.testing.assert_allclose(skate[1:, 0], 0.5 * weight, atol=1e-3)
    np.testing.assert_allclose(skate[1:, 1], 0.0, atol=1e-12)
    assert np.isnan(skate[0]).all(), "the first frame has no speed"


def test_a_lifted_toe_does_not_skate():
    assert np.isnan(foot_skate(sliding(1.01 * SKATE_HEIGHT))).all()


def test_speed_over_the_floor_knows_no_height():
    toes = sliding(0.0)
    toes[..., 1] += np.arange(len(toes))[:, None]
    np.testing.assert_allclose(horizontal_speed(toes)[1:], [[0.5, 0.0]] * 19, atol=1e-9)


@pytest.mark.parametrize("fps", [30, 60])
def test_jerk_of_a_cubic_is_its_third_derivative(fps):
    t = np.arange(30) / fps
    positions, root = np.zeros((30, 2, 3)), np.zeros((30, 3))
    root[:, 2] = 5 * t**3
    positions[:] = root[:, None]
    positions[:, 1] += np.stack([2 * t**3, -1 * t**3, 2 * t**3], axis=-1)  # |(12, -6, 12)| = 18
    values = jerk(positions, root, fps)
    assert values.shape == (30, 2) and np.isnan(values[:3]).all()
    np.testing.assert_allclose(values[3:], [[0.0, 18.0]] * 27, atol=1e-6)


def test_frechet_distance_of_known_gaussians():
    random = np.random.default_rng(3)
    a = random.normal(size=(20000, 3))
    assert frechet_distance(a, a) == pytest.approx(0.0, abs=1e-9)
    assert frechet_distance(a, a + [3.0, 0.0, 4.0]) == pytest.approx(25.0, abs=1e-6)
    assert frechet_distance(a, a * [1.0, 1.0, 3.0]) == pytest.approx((3 - 1) ** 2, rel=0.05)
    assert frechet_distance(a, 2 * a) == frechet_distance(2 * a, a) == pytest.approx(3.0, rel=0.05)
    flat, slanted = a * [1.0, 1.0, 3.0], a * [1.0, 1.0, 3.0]
    slanted = slanted[:, [2, 1, 0]]
    assert frechet_distance(flat, slanted) == pytest.approx(8.0, rel=0.05), "which way it spreads counts as well"


def test_frechet_distance_is_finite_for_few_samples():
    few = np.random.default_rng(3).normal(size=(5, 40))
    assert np.isfinite(frechet_distance(few, few + 1.0)) and frechet_distance(few, few) == pytest.approx(0.0, abs=1e-6)


def test_pose_and_velocity_are_lengths():
    features = clip_features(walking_clip())
    vector = pose_and_velocity(features)
    assert vector.shape == (240, 21 * 3 + 21 * 3 + 3)
    np.testing.assert_allclose(vector[10:-10, -3:], [[0.0, SPEED * VELOCITY_SECONDS, 0.0]] * 220, atol=1e-3)
    np.testing.assert_allclose(vector[:, :63].reshape(-1, 21, 3), features[..., :3])
