"""Hands and forearms are kept out of the body, smoothly, and left alone where they touch nothing."""

import numpy as np
import pytest

from sim.body.limb_ik import ARMS, ELBOWS_BACK, reach
from sim.body.pose import Pose
from sim.body.skeleton import INDEX, JOINT_COUNT, REST_HIPS_HEIGHT
from sim.hands.hand_clearance import (
    HAND,
    LONGEST,
    LOWER,
    UPPER,
    YIELD,
    HandClearance,
    arm_depths,
    clear_hands,
)
from sim.math import rotations as rot
from sim.motion.clip import FPS

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
    """(...) metres that a hand or a forearm is in something at most."""
    return np.maximum(*arm_depths(pose))


def settled(pose: Pose, clearance: HandClearance | None = None) -> Pose:
    clearance = clearance or HandClearance()
    for _ in range(90):
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
        ((-0.10, 0.20, 0.16), FREE[1]),  # the forearm alone, in the belly
    ],
)
def test_a_hand_in_the_body_comes_out(left, right):
    pose = with_hands(left, right)
    assert depth(pose) > 0.02
    after = settled(pose)
    assert depth(after) < YIELD + 0.004
    others = np.setdiff1d(np.arange(JOINT_COUNT), ARM_JOINTS)
    np.testing.assert_array_equal(after.rotations[others], pose.rotations[others])
    np.testing.assert_array_equal(after.hips, pose.hips)
    moved = [rot.length(after.positions[joints] - pose.positions[joints]).max() for joints in (LOWER, HAND)]
    assert max(moved) < LONGEST + 0.01


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
    """From the front of the belly into it, the elbow ahead, and back: by the flank, and never faster than it goes
    itself by more than a touch."""
    swing = np.concatenate([np.linspace(0.24, -0.02, 30), np.linspace(-0.02, 0.24, 30)])
    poses = [with_hands((0.03, 0.25, z), FREE[1]) for z in swing]
    clearance = HandClearance()
    after = [clearance.step(pose) for pose in poses]
    places = np.array([pose.positions[HAND[0]] for pose in after])
    assert min(depth(pose) for pose in poses[24:36]) > 0.04
    assert max(depth(pose) for pose in after) < 0.025
    assert places[:, 0].min() > 0.02, "it goes round by its own flank"
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


def test_an_elbow_is_not_thrown_about_where_the_arm_is_stretched():
    """A straight arm through the thigh and back: inverse kinematics would throw its elbow at 8 g."""
    swing = 0.2 + 0.18 * np.cos(np.linspace(0, 2 * np.pi, 60))
    poses = [with_hands((x, -0.10, 0.0), FREE[1]) for x in swing]
    assert max(depth(pose) for pose in poses) > 0.08
    clearance = HandClearance()
    elbows = [[pose.positions[LOWER[0]] for pose in each] for each in (poses, [clearance.step(pose) for pose in poses])]
    own, worst = (rot.length(np.diff(each, 2, axis=0)).max() * FPS**2 for each in elbows)
    assert worst - own < 2 * 9.81


def test_bones_keep_their_lengths_and_hands_their_attitude():
    pose = with_hands(*IN_BELLY)
    after = settled(pose)
    np.testing.assert_array_equal(after.rotations[HAND], pose.rotations[HAND])
    for start, stop in ((UPPER, LOWER), (LOWER, HAND)):
        lengths = [rot.length(each.positions[stop] - each.positions[start]) for each in (after, pose)]
        np.testing.assert_allclose(*lengths, atol=1e-12)
