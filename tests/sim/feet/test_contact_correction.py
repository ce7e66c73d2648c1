"""Foot clean-up of whole clips and longer strides, on feet with a known fault."""

from dataclasses import replace

import numpy as np
import pytest

from sim.body.skeleton import BONE_OFFSETS, CONTACT_JOINTS, INDEX, TOE_HEIGHT, TOES
from sim.feet.contact_correction import CLEARANCE, plant_feet, scale_strides
from sim.math import rotations as rot
from sim.motion.clip import FPS, root_frame
from sim.motion.contacts import foot_contacts
from sim.motion.metrics import foot_skate, horizontal_speed, jerk
from tests.support.walker import planted_clip, walking_clip


def sliding_clip(speed: float = 0.05):
    """Stands for two seconds on bent legs whose feet slide forward all the time, slightly in the floor."""
    clip = planted_clip(2 * FPS)
    for joint, bend in (("UpLeg", -0.4), ("Leg", 0.8), ("Foot", -0.4)):
        for side in ("Left", "Right"):
            clip.rotations[:, INDEX[side + joint]] = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), bend)
    clip = clip.grounded()
    way = np.arange(len(clip))[:, None] / FPS * speed * np.array([0.0, 0.0, 1.0])
    return replace(clip, hips=clip.hips + way - [0.0, 0.01, 0.0])


def test_planted_feet_stand_still_and_level_while_the_body_goes_on():
    clip = sliding_clip()
    clean = plant_feet(clip, np.ones((len(clip), 4)))
    np.testing.assert_array_equal(clean.hips, clip.hips)
    feet = clean.positions()[20:-20, CONTACT_JOINTS]
    before = horizontal_speed(clip.positions()[20:-20, CONTACT_JOINTS])[1:].mean()
    assert before == pytest.approx(0.05) and horizontal_speed(feet)[1:].mean() < 0.005
    assert np.abs(clip.positions()[:, TOES, 1] - TOE_HEIGHT).mean() == pytest.approx(0.01)
    np.testing.assert_allclose(clean.positions()[20:-20, TOES, 1], TOE_HEIGHT, atol=0.004)


def test_a_clip_without_contacts_is_left_alone_and_bones_keep_their_length():
    clip = walking_clip(120)
    lifted = replace(clip, hips=clip.hips + [0.0, 0.5, 0.0])
    np.testing.assert_allclose(plant_feet(lifted).positions(), lifted.positions(), atol=1e-6)
    bones = plant_feet(clip.grounded()).positions()
    lengths = np.linalg.norm(bones[:, TOES] - bones[:, CONTACT_JOINTS[::2]], axis=-1)
    np.testing.assert_allclose(lengths, np.linalg.norm(BONE_OFFSETS[INDEX["LeftToe"]]), atol=1e-9)


def test_a_walk_skates_less_and_swings_clear_of_the_floor():
    clip = walking_clip(300).grounded()
    clean = plant_feet(clip)
    skate = [np.nanmean(foot_skate(c.positions()[:, TOES])) for c in (clip, clean)]
    assert skate[1] < 0.5 * skate[0]
    toes = clean.positions()[:, TOES]
    fast = horizontal_speed(toes) > 1.5
    assert fast.any() and toes[..., 1][fast].min() > TOE_HEIGHT + 0.5 * CLEARANCE
    assert np.nanmean(jerk(clean.positions(), root_frame(clean.positions()).positions)) < 100, "captured walks have 150"


def test_longer_strides_go_further_in_the_same_time_without_sliding():
    clip = plant_feet(walking_clip(300).grounded())
    wide = scale_strides(clip, 1.4)
    way = [np.linalg.norm(np.diff(root_frame(c.positions()).positions[[10, -10]], axis=0)) for c in (clip, wide)]
    assert way[1] == pytest.approx(1.4 * way[0], rel=1e-3) and len(wide) == len(clip)
    contacts = foot_contacts(clip) > 0
    speeds = [horizontal_speed(c.positions()[:, CONTACT_JOINTS])[contacts][2:].mean() for c in (clip, wide)]
    assert speeds[1] < 1.6 * speeds[0]
    assert wide.hips[:, 1].mean() < clip.hips[:, 1].mean(), "a longer stride needs the hips lower"
    assert scale_strides(clip, 1.0) is clip


@pytest.mark.parametrize("frames", (1, 3, 5))
def test_clips_of_a_few_frames_pass(frames):
    assert len(plant_feet(planted_clip(60)[:frames])) == frames


def test_standing_feet_are_not_moved():
    clip = planted_clip(90)
    np.testing.assert_allclose(plant_feet(clip).positions(), clip.positions(), atol=1e-6)
    assert np.allclose(
        rot.to_rotation_vector(plant_feet(clip).rotations), rot.to_rotation_vector(clip.rotations), atol=1e-5
    )
