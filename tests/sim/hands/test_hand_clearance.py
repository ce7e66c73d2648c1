"""Hands are kept out of the body, smoothly, and left alone where they touch nothing."""

import numpy as np
import pytest

from sim.body.capsules import capsule_ends
from sim.body.limb_ik import ARMS, ELBOWS_BACK, reach
from sim.body.pose import Pose
from sim.body.skeleton import INDEX, JOINT_COUNT, REST_HIPS_HEIGHT
from sim.hands.hand_clearance import (
    HAND,
    LONGEST,
    OBSTACLES,
    YIELD,
    HandClearance,
    clear_hands,
    depths,
    hand_balls,
)
from sim.math import rotations as rot

REST = Pose(
    np.zeros(3), 0.0, np.array([0, REST_HIPS_HEIGHT, 0.0]), np.tile(rot.IDENTITY, (JOINT_COUNT, 1)), np.zeros(4), 0.0
)
ARM_JOINTS = np.concatenate(ARMS[:2])


def with_hands(left, right) -> Pose:
    """The rest pose with its hands at places relative to the hips, fingers down and palms in."""
    rotations = REST.rotations.copy()
    for joint, degrees in zip(HAND, (-90.0, 90.0)):
        rotations[joint] = rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.radians(degrees))
    pose = REST.with_body(REST.hips, rotations)
    return reach(pose, ARMS, REST.hips + np.array([left, right]), ELBOWS_BACK, 0.999)


FREE = ((0.40, 0.20, 0.10), (-0.40, 0.20, 0.10))
IN_BELLY = ((0.06, 0.22, 0.07), (-0.40, 0.20, 0.10))


def depth(pose: Pose) -> np.ndarray:
    """(..., 2) metres that each hand is in something at most."""
    deep, _ = depths(hand_balls(pose), capsule_ends(pose)[..., OBSTACLES, :, :])
    return deep.max(axis=(-2, -1))


def settled(pose: Pose, clearance: HandClearance | None = None) -> Pose:
    clearance = clearance or HandClearance()
    for _ in range(60):
        result = clearance.step(pose)
    return result


def test_a_pose_whose_hands_touch_nothing_is_the_same_object():
    pose, clearance = with_hands(*FREE), HandClearance()
    assert all(clearance.step(pose) is pose for _ in range(5))


@pytest.mark.parametrize(
    "left, right",
    [
        IN_BELLY,
        ((0.10, 0.06, 0.06), FREE[1]),  # the thigh and the hip
        ((0.02, 0.25, 0.30), (-0.02, 0.25, 0.30)),  # each other
        ((-0.10, 0.46, 0.08), FREE[1]),  # the other side of the breast
    ],
)
def test_a_hand_in_the_body_comes_out(left, right):
    pose = with_hands(left, right)
    assert depth(pose).max() > 0.02
    after = settled(pose)
    assert depth(after).max() < YIELD + 0.004
    others = np.setdiff1d(np.arange(JOINT_COUNT), ARM_JOINTS)
    np.testing.assert_array_equal(after.rotations[others], pose.rotations[others])
    np.testing.assert_array_equal(after.hips, pose.hips)
    assert rot.length(after.positions[HAND] - pose.positions[HAND]).max() < LONGEST + 0.01


def test_the_other_arm_stays_to_the_last_bit():
    pose = with_hands(*IN_BELLY)
    after = settled(pose)
    right = [INDEX["Right" + name] for name in ("Arm", "ForeArm", "Hand")]
    np.testing.assert_array_equal(after.rotations[right], pose.rotations[right])


def test_a_hand_that_was_moved_comes_back_and_the_pose_is_then_the_same_object():
    clearance, free = HandClearance(), with_hands(*FREE)
    settled(with_hands(*IN_BELLY), clearance)
    assert clearance.step(free) is not free
    assert settled(free, clearance) is free


def test_a_hand_that_swings_through_the_body_goes_round_it_on_one_side():
    """From the front of the belly into it and back: never on its other side, and never faster than it goes itself by
    more than a touch."""
    swing = np.concatenate([np.linspace(0.24, -0.02, 30), np.linspace(-0.02, 0.24, 30)])
    poses = [with_hands((0.03, 0.25, z), FREE[1]) for z in swing]
    clearance = HandClearance()
    places = np.array([clearance.step(pose).positions[HAND[0]] for pose in poses])
    assert min(depth(pose).max() for pose in poses[24:36]) > 0.04
    assert places[:, 2].min() > 0.08, "it stays before the belly"
    own = np.array([pose.positions[HAND[0]] for pose in poses])
    step, own_step = (rot.length(np.diff(each, axis=0)).max() for each in (places, own))
    assert step < 2 * own_step


def test_a_crowd_moves_as_each_would_alone():
    poses = [with_hands(*FREE), with_hands(*IN_BELLY)]
    crowd, together = HandClearance(), Pose.stacked(poses)
    alone = [settled(pose) for pose in poses]
    both = settled(together, crowd)
    np.testing.assert_allclose(both.positions, [pose.positions for pose in alone], atol=1e-12)


def test_a_clip_is_cleared_as_it_would_be_live_and_an_arm_of_no_share_is_left_alone():
    clip = Pose.stacked([with_hands((0.03, 0.25, z), (-0.03, 0.25, z)) for z in np.linspace(0.2, 0.02, 20)])
    clearance = HandClearance()
    live = np.array([clearance.step(clip[frame]).positions for frame in range(20)])
    np.testing.assert_allclose(clear_hands(clip, np.ones(2)).positions, live, atol=1e-12)
    left = clear_hands(clip, np.array([1.0, 0.0]))
    right = [INDEX["Right" + name] for name in ("Arm", "ForeArm")]
    np.testing.assert_array_equal(left.rotations[:, right], clip.rotations[:, right])
    assert clear_hands(clip, np.zeros(2)) is clip
