"""The measures of style transfer have known answers on made-up motion."""

import numpy as np
import pytest

from sim.body.skeleton import INDEX, PART_NAMES, PARTS
from sim.math import rotations as rot
from sim.motion.features import clip_features
from stylizer.evaluation import metrics as measures
from tests.support.walker import walking_clip

ARM = list(PARTS["left_arm"])


@pytest.fixture(scope="module")
def walk():
    return clip_features(walking_clip())


def swinging(hertz, frames=240, amplitude=0.3):
    """Features of a left arm that swings forward and back `hertz` times a second."""
    clip = walking_clip(frames)
    angle = amplitude * np.sin(2 * np.pi * hertz * np.arange(frames) / 60)
    clip.rotations[:, INDEX["LeftArm"]] = rot.from_axis_angle(np.tile([1.0, 0, 0], (frames, 1)), angle)
    return clip_features(clip)


@pytest.mark.parametrize("name", measures.STATISTICS)
def test_shares_of_the_way(walk, name):
    content, style = measures.STATISTICS[name](walk), measures.STATISTICS[name](swinging(1.0) + 0.1 * np.arange(15))
    for share in (0.0, 0.5, 1.0):
        arm = measures.shares(measures.part_distances(content + share * (style - content), content, style) + 1e-12)[
            "left_arm"
        ]
        assert arm["closed"] == pytest.approx(share, abs=1e-6) and arm["progress"] == pytest.approx(share, abs=1e-6)


def test_overshooting_leaves_a_gap_though_the_way_is_gone(walk):
    content = measures.mean_pose(walk)
    arm = measures.shares(measures.part_distances(content + 0.15, content, content + 0.1))["left_arm"]
    assert arm["progress"] == pytest.approx(1.5) and arm["closed"] == pytest.approx(0.5)


def test_a_swing_is_found_in_its_band():
    for band, hertz in enumerate((1.0, 2.0, 4.0, 8.0)):
        found = measures.spectrum(swinging(hertz))[INDEX["LeftArm"]]
        assert found.argmax() == band and found[band] > 0.8 * np.linalg.norm(found)
    whole = swinging(2.0)[..., 3:9].std(axis=0)[INDEX["LeftArm"]]
    assert np.linalg.norm(measures.spectrum(swinging(2.0))[INDEX["LeftArm"]]) == pytest.approx(
        np.linalg.norm(whole), rel=0.05
    )


def test_geodesic_is_the_angle():
    turned = rot.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.full((7, 21), 0.3))
    assert measures.geodesic(turned, np.broadcast_to(rot.IDENTITY, turned.shape)) == pytest.approx(0.3)


def test_displacement_is_relative_to_the_hips_and_the_height():
    content = walking_clip(30).positions()
    moved = content + np.array([0.0, 0.2, 0.0])
    moved[:, ARM] += np.array([0.175, 0.0, 0.0])
    parts = measures.by_part(measures.joint_displacement(moved, content))
    assert (
        parts.pop("left_arm") == pytest.approx(0.1) and max(parts.values()) < 1e-9 and len(parts) == len(PART_NAMES) - 1
    )


def test_jerk_ratio_sees_noise():
    clip = walking_clip(120)
    positions, root = clip.positions(), clip.hips
    assert measures.jerk_ratio(positions, positions, root) == pytest.approx(1.0)
    noisy = positions + np.random.default_rng(0).normal(0, 1e-4, positions.shape)
    every, second = (measures.jerk_ratio(noisy, positions, root, step) for step in (1, 2))
    assert every > 3 * second > 3
