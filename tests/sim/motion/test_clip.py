"""Clips: resampling, pace, mirroring, floor, root frame, contacts and features on motion with known answers."""

from dataclasses import replace

import numpy as np
import pytest

from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT, MIRROR, TOE_HEIGHT
from sim.math import rotations as rot
from sim.motion.clip import FPS, Clip, root_frame
from sim.motion.contacts import foot_contacts
from sim.motion.feature_window import RingBuffer
from sim.motion.features import FEATURES, LAYOUT, STRIDE, WINDOW, clip_features, rotations_of
from tests.support.walker import SPEED, planted_clip, walking_clip


def test_resampling_keeps_length_in_seconds_and_the_frames_that_both_have():
    clip = walking_clip(121)
    coarse = clip.resampled(30)
    assert len(coarse) == 61
    np.testing.assert_allclose(coarse.positions(), clip.positions()[::2], atol=1e-9)
    back = coarse.resampled(60)
    np.testing.assert_allclose(back.positions()[::2], clip.positions()[::2], atol=1e-9)
    assert np.abs(back.positions() - clip.positions()).max() < 0.01


def test_pace_makes_the_same_way_take_less_time():
    clip = walking_clip(201)
    fast = clip.paced(2.0)
    assert (len(fast), fast.fps) == (101, FPS)
    np.testing.assert_allclose(fast.positions(), clip.positions()[::2], atol=1e-9)


def test_mirroring_swaps_sides_and_undoes_itself():
    rng = np.random.default_rng(1)
    clip = Clip(rng.normal(size=(5, 3)), rot.normalize(rng.normal(size=(5, JOINT_COUNT, 4))))
    np.testing.assert_allclose(clip.mirrored().positions()[:, MIRROR] * [-1, 1, 1], clip.positions(), atol=1e-9)
    np.testing.assert_allclose(clip.mirrored().mirrored().positions(), clip.positions(), atol=1e-9)


def test_floor_is_found_under_a_lifted_clip():
    clip = planted_clip()
    lifted = replace(clip, hips=clip.hips + [0, 0.37, 0])
    assert lifted.grounded().positions()[..., 1].min() == pytest.approx(TOE_HEIGHT)


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_root_frame_follows_a_straight_walk_to_its_very_ends(yaw):
    root = root_frame(walking_clip(yaw=yaw).positions())
    np.testing.assert_allclose(rot.wrap_angle(root.facing - yaw), 0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(np.diff(root.positions, axis=0), axis=-1) * FPS, SPEED, atol=1e-6)


def test_standing_feet_are_in_contact_and_lifted_ones_are_not():
    clip = planted_clip()
    assert foot_contacts(clip).all()
    assert not foot_contacts(replace(clip, hips=clip.hips + [0, 0.3, 0])).any()
    walk = foot_contacts(walking_clip().grounded())
    assert not walk.all(axis=0).any()


def test_features_hold_what_the_paper_says():
    features = clip_features(walking_clip(yaw=0.7))
    assert features.shape == (240, JOINT_COUNT, FEATURES)
    np.testing.assert_allclose(
        features[..., LAYOUT["root"]], np.broadcast_to([0, SPEED, 0], features[..., :3].shape), atol=1e-6
    )
    np.testing.assert_allclose(features[5:-5, 0, LAYOUT["velocity"]], 0, atol=1e-6)  # the root's velocity is taken out
    np.testing.assert_allclose(
        rotations_of(features)[:, 0], np.broadcast_to(np.eye(3), (len(features), 3, 3)), atol=1e-9
    )


def test_features_do_not_depend_on_where_and_whither():
    here, there = walking_clip(), walking_clip(yaw=2.0)
    there = replace(there, hips=there.hips + [5.0, 0, -3.0])
    np.testing.assert_allclose(clip_features(here), clip_features(there), atol=1e-6)


def test_ring_buffer_makes_the_features_that_the_whole_clip_has():
    clip = walking_clip(100, yaw=0.3)
    rotations, root = clip.global_rotations(), root_frame(clip.positions())
    ring = RingBuffer()
    for t in range(len(clip)):
        ring.push(Pose(root.positions[t], root.facing[t], clip.hips[t], rotations[t], np.ones(4), 0.0))
    window = ring.window()
    assert window.shape == (WINDOW, JOINT_COUNT, FEATURES)
    np.testing.assert_allclose(window, clip_features(clip)[99 - STRIDE * (WINDOW - 1) :: STRIDE], atol=1e-9)
