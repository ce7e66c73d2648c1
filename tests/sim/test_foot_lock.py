"""The foot lock on feet that slide, float, sink and lift."""

import numpy as np
import pytest

from sim import rotations as rot
from sim.foot_lock import FootLock
from sim.kinematics import to_local
from sim.pose import Pose
from sim.ring_buffer import RingBuffer
from sim.skeleton import BONE_OFFSETS, CONTACT_JOINTS, JOINT_COUNT, PARENTS, REST_HIPS_HEIGHT, TOE_HEIGHT
from tests.sim.walker import walking_clip


def standing(x: float = 0.0, lift: float = 0.0, contacts=(1, 1, 1, 1)) -> Pose:
    rotations = np.tile(rot.IDENTITY, (JOINT_COUNT, 1))
    rotations[[1, 5]] = rot.from_axis_angle(np.array([1.0, 0, 0]), -0.3)
    rotations[[2, 6]] = rot.from_axis_angle(np.array([1.0, 0, 0]), 0.3)
    pose = Pose(np.array([x, 0, 0]), 0.0, np.array([x, REST_HIPS_HEIGHT, 0]), rotations, np.array(contacts, float), 0.0)
    sunk = pose.positions[CONTACT_JOINTS, 1].min() - TOE_HEIGHT
    return pose.with_body(pose.hips - [0, sunk - lift, 0], rotations)


def run(poses: list[Pose]) -> list[Pose]:
    lock = FootLock()
    return [lock.step(pose, pose) for pose in poses]


def test_planted_feet_do_not_slide_while_the_body_sways():
    locked = run([standing(0.04 * np.sin(t / 20)) for t in range(120)])
    feet = np.array([p.positions[CONTACT_JOINTS] for p in locked])
    assert np.ptp(feet[..., 0]) < 0.3 and np.abs(np.diff(feet[:, :, [0, 2]], axis=0)).max() < 1e-6
    assert np.ptp([p.hips[0] for p in locked]) > 0.07


def test_lifted_feet_come_back_to_where_the_motion_has_them():
    poses = [standing(0.004 * t) for t in range(16)] + [standing(0.06, contacts=(0, 0, 0, 0)) for _ in range(60)]
    locked = run(poses)
    held, free = (np.linalg.norm(locked[t].positions[3] - poses[t].positions[3]) for t in (15, 75))
    assert held > 0.05 and free < 0.001
    steps = np.diff([p.positions[3] for p in locked], axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 0.02  # released, not snapped


def test_a_foot_left_out_of_place_takes_a_step_once_the_character_stands():
    poses = [standing(0.008 * t) for t in range(15)] + [standing(0.112) for _ in range(150)]
    locked = run(poses)
    apart = [np.linalg.norm((b.positions - a.positions)[[3, 7]], axis=-1) for a, b in zip(poses, locked)]
    assert apart[15].min() > 0.1 and apart[-1].max() < 0.03
    contacts = np.array([p.contacts for p in locked])
    assert contacts.reshape(-1, 2, 2).max(axis=2).sum(axis=1).min() == 1  # one foot at a time, and it says so
    lifted = max(p.positions[[4, 8], 1].max() for p in locked)
    assert TOE_HEIGHT + 0.01 < lifted < TOE_HEIGHT + 0.05


def test_nothing_sinks_under_the_floor_and_sunk_feet_rise():
    locked = run([standing(lift=-0.1) for _ in range(30)])
    assert min(p.positions[:, 1].min() for p in locked) >= 0
    assert locked[-1].positions[CONTACT_JOINTS, 1].min() == pytest.approx(TOE_HEIGHT, abs=0.005)


def test_bones_keep_their_length_and_the_upper_body_its_attitude():
    clip = walking_clip(60).grounded()
    rotations = clip.global_rotations()
    poses = [Pose(clip.hips[t] * [1, 0, 1], 0.0, clip.hips[t], rotations[t], np.array([1.0, 1, 0, 0]), 0.0) for t in range(60)]
    for before, after in zip(poses, run(poses)):
        bones = after.positions[1:] - after.positions[PARENTS[1:]]
        np.testing.assert_allclose(np.linalg.norm(bones, axis=-1), np.linalg.norm(BONE_OFFSETS[1:], axis=-1), atol=1e-9)
        np.testing.assert_array_equal(after.rotations[9:], before.rotations[9:])
        assert np.isfinite(to_local(after.rotations)).all()


def test_a_restyled_leg_keeps_the_stride_of_the_neutral_one_and_its_own_stance():
    clip = walking_clip(240).grounded()
    rotations, lock = clip.global_rotations(), FootLock()
    short = rotations.copy()
    for joint in (1, 2, 5, 6):
        short[:, joint] = rot.slerp(np.tile(rot.IDENTITY, (240, 1)), rotations[:, joint], 0.4)  # less than half the stride
    apart, unlocked = [], []
    for t in range(240):
        neutral = Pose(clip.hips[t] * [1, 0, 1], 0.0, clip.hips[t], rotations[t], np.zeros(4), 0.0)
        styled = neutral.with_body(clip.hips[t], short[t])
        for poses, pose in ((unlocked, styled), (apart, lock.step(styled, neutral))):
            poses.append((pose.positions - neutral.positions)[[3, 7], 2])
    assert np.ptp(np.array(apart)[120:]) < 0.3 * np.ptp(np.array(unlocked)[120:])


def test_a_crowd_is_locked_and_remembered_each_as_it_would_be_alone():
    """One slides until it takes a settling step, one drifts off its toes, one walks on the spot."""
    slides = [standing(0.004 * min(t, 20)) for t in range(90)]
    drifts = [standing(0.001 * t, lift=0.02, contacts=(t % 40 < 20, 1, 0.3, 0.6)) for t in range(90)]
    clip = walking_clip(90).grounded()
    walks = [Pose(hips * [1, 0, 1], 0.4, hips, rotations, np.array([t % 30 < 15] * 2 + [t % 30 >= 15] * 2, float), 0.0)
             for t, (hips, rotations) in enumerate(zip(clip.hips, clip.global_rotations()))]
    lock, history = FootLock(), RingBuffer()
    alone = [run(poses) for poses in (slides, drifts, walks)]
    windows = [RingBuffer() for _ in alone]
    for t, each in enumerate(zip(slides, drifts, walks)):
        crowd = Pose.stacked(each)
        history.push(crowd)
        locked = lock.step(crowd, crowd)
        for one, window in enumerate(windows):
            window.push(each[one])
            np.testing.assert_allclose(locked[one].positions, alone[one][t].positions, atol=1e-9)
            np.testing.assert_allclose(history.window()[one], window.window(), atol=1e-9)
