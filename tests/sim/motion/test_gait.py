"""Gait read from ankles that go where a formula says: phase, cadence, what repeats with the stride, kinds of
movement."""

import numpy as np
import pytest

from sim.body.skeleton import CONTACT_JOINTS, JOINT_COUNT, TOE_HEIGHT
from sim.motion.clip import FPS
from sim.motion.features import FEATURES, LAYOUT, clip_features
from sim.motion.gait import (
    ANKLES,
    FEW_HARMONICS,
    HARMONICS,
    MOVEMENTS,
    airborne_share,
    cadence,
    cycle_at,
    fit_cycle,
    movement_of,
    stride_phase,
)
from tests.support.walker import CYCLE, walking_clip

FRAMES = 300


def stepping(phase: np.ndarray, swing: float = 0.3, way=(0.0, 1.0), speed: float = 1.2) -> np.ndarray:
    """Features (frames, 21, 15) of ankles that swing along a way over the floor, the left one passing the right one at
    phase 0."""
    features = np.zeros((len(phase), JOINT_COUNT, FEATURES))
    way = np.array(way)
    for ankle, sign in zip(ANKLES, (1, -1)):
        features[:, ankle, 0] = sign * 0.1 + sign * swing * np.sin(phase) * way[0]
        features[:, ankle, 2] = sign * swing * np.sin(phase) * way[1]
    features[..., 12:14] = speed * way
    return features


def wrapped(angles: np.ndarray) -> np.ndarray:
    return (angles + np.pi) % (2 * np.pi) - np.pi


@pytest.mark.parametrize("strides_a_second", [0.6, 1.0, 1.45])
@pytest.mark.parametrize("start", [-2.0, 0.4, 3.0])
@pytest.mark.parametrize("way", [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-0.6, 0.8)])
def test_phase_and_cadence_are_those_of_the_ankles(strides_a_second, start, way):
    phase = start + 2 * np.pi * strides_a_second * np.arange(FRAMES) / FPS
    features = stepping(phase, way=way)
    found = stride_phase(features)
    assert np.abs(wrapped(found - phase)).max() < 0.05  # the mean of strides that are not whole is not quite 0
    assert np.diff(found).min() > 0, "unwrapped, and at the ends it goes on as it went"
    assert cadence(features) == pytest.approx(strides_a_second, rel=5e-3)


def test_the_strides_of_a_changing_cadence_are_counted():
    phase = np.cumsum(np.linspace(0.05, 0.16, FRAMES))
    found = stride_phase(stepping(phase))
    inner = slice(60, -40)  # outside the first and last step the phase is a guess
    assert np.abs(wrapped(found - phase))[inner].max() < 0.15
    assert np.ptp(found[inner]) == pytest.approx(np.ptp(phase[inner]), abs=0.15)


def test_a_foot_that_trembles_as_it_passes_makes_one_step():
    phase = 2 * np.pi * np.arange(FRAMES) / FPS
    features = stepping(phase)
    features[:, ANKLES[0], 2] += 0.09 * np.sin(2 * np.pi * 13.7 * np.arange(FRAMES) / FPS)
    apart = features[:, ANKLES[0], 2] - features[:, ANKLES[1], 2]
    assert (np.diff(np.sign(apart - apart.mean())) != 0).sum() > 12, (
        "it passes more often than ten times in five strides"
    )
    assert cadence(features) == pytest.approx(1.0, rel=0.03)


@pytest.mark.parametrize(
    "frames, swing", [(FRAMES, 0.0), (FRAMES, 0.01), (35, 0.3)], ids=["still", "swaying", "half a stride"]
)
def test_who_makes_no_stride_has_no_phase(frames, swing):
    features = stepping(2 * np.pi * np.arange(frames) / FPS, swing)
    assert stride_phase(features) is None and cadence(features) == 0.0


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_a_walk_on_bones_has_its_own_cadence(yaw):
    for clip in (walking_clip(240, yaw), walking_clip(240, yaw).mirrored()):
        assert cadence(clip_features(clip)) == pytest.approx(FPS / CYCLE, rel=0.01)
    assert cadence(clip_features(walking_clip(240, yaw).paced(1.4))) == pytest.approx(1.4 * FPS / CYCLE, rel=0.02)


def test_what_repeats_with_the_stride_comes_back_at_any_phase():
    rng = np.random.default_rng(0)
    coefficients = rng.normal(size=(1 + 2 * HARMONICS, 3, 2))
    phase = 0.3 + 2 * np.pi * 1.1 * np.arange(FRAMES) / FPS
    signal = cycle_at(coefficients, phase)
    assert signal.shape == (FRAMES, 3, 2)
    np.testing.assert_allclose(fit_cycle(signal, phase), coefficients, atol=1e-6)
    np.testing.assert_allclose(cycle_at(fit_cycle(signal, phase), phase), signal, atol=1e-6)
    np.testing.assert_allclose(cycle_at(coefficients, phase), cycle_at(coefficients, phase + 2 * np.pi), atol=1e-9)
    mean_alone = coefficients * np.eye(len(coefficients))[0][:, None, None]
    assert cycle_at(mean_alone, phase).std(axis=0).max() < 1e-12


def test_a_motion_of_little_more_than_a_stride_tells_few_harmonics():
    phase = np.linspace(0, 2 * np.pi * 1.3, 80)
    found = fit_cycle(np.sin(phase)[:, None], phase)
    assert np.abs(found[2]).max() == pytest.approx(1.0, abs=1e-6)
    assert found[1 : 1 + 2 * FEW_HARMONICS].any() and not found[1 + 2 * FEW_HARMONICS :].any()


def test_what_has_its_own_time_is_no_part_of_the_cycle():
    time = np.arange(600) / FPS
    phase = 2 * np.pi * time
    signal = np.stack([np.sin(phase), np.sin(2 * np.pi * 0.37 * time)], axis=-1)
    locked = cycle_at(fit_cycle(signal, phase), phase)
    assert np.abs(locked[:, 0] - signal[:, 0]).max() < 1e-6 and locked[:, 1].std() < 0.15 * signal[:, 1].std()


def test_the_share_of_time_in_the_air():
    features = np.zeros((100, JOINT_COUNT, FEATURES))
    features[:, CONTACT_JOINTS, 1] = TOE_HEIGHT
    assert airborne_share(features) == 0.0
    features[:30, CONTACT_JOINTS[:2], 1] += 0.2
    assert airborne_share(features) == 0.0, "the right foot stands"
    features[10:30, CONTACT_JOINTS[2:], 1] += 0.2
    assert airborne_share(features) == pytest.approx(0.2)


@pytest.mark.parametrize(
    "name, velocity, more",
    [
        ("stand", (0.0, 0.1, 0.0), {}),
        ("stand", (0.1, -0.1, 0.2), {}),
        ("walk", (0.0, 0.25, 0.0), {}),
        ("walk", (0.2, 1.3, -0.3), {}),
        ("walk", (0.5, 1.6, 0.0), {"airborne": 0.05, "strides": 1.0}),
        ("run", (0.0, 1.8, 0.0), {}),
        ("run", (0.0, 3.5, 0.2), {}),
        ("run", (0.0, 1.5, 0.0), {"airborne": 0.2}),
        ("run", (0.0, 1.5, 0.0), {"strides": 1.3}),
        ("walk", (0.0, 1.2, 0.0), {"airborne": 0.2, "strides": 1.3}),
        ("back", (0.0, -0.4, 0.0), {}),
        ("back", (0.2, -1.3, 0.0), {}),
        ("strafe left", (0.9, 0.1, 0.0), {}),
        ("strafe right", (-0.9, -0.5, 0.0), {}),
        ("turn left", (0.0, 1.0, 0.8), {}),
        ("turn right", (0.0, 0.0, -1.5), {}),
    ],
)
def test_kinds_of_movement(name, velocity, more):
    assert movement_of(np.array(velocity), **more) == name and name in MOVEMENTS


def test_mirrored_movements_have_mirrored_names():
    sides = {"left": "right", "right": "left"}
    for velocity in np.random.default_rng(2).uniform(-2, 2, (200, 3)):
        kind, mirrored = movement_of(velocity), movement_of(velocity * [-1, 1, -1])
        assert mirrored == " ".join(sides.get(word, word) for word in kind.split())


def test_features_say_where_the_root_goes():
    """The layout that the formulas above rely on."""
    assert (LAYOUT["root"].start, LAYOUT["position"].start) == (12, 0)
