"""The foot lock on feet that slide, float, sink and lift, and under styled legs that carry the body their own way."""

import numpy as np
import pytest

from sim.body.kinematics import to_local
from sim.body.limb_ik import KNEES_FORWARD, LEGS, reach
from sim.body.pose import Pose
from sim.body.skeleton import (
    ANKLE_HEIGHT,
    BONE_OFFSETS,
    CONTACT_JOINTS,
    JOINT_COUNT,
    PARENTS,
    REST_HIPS_HEIGHT,
    TOE_HEIGHT,
)
from sim.feet.foot_lock import MODERATE, FootLock
from sim.ground.ground import Ground
from sim.math import rotations as rot
from sim.motion.feature_window import RingBuffer
from tests.support.walker import walking_clip


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
    poses = [
        Pose(clip.hips[t] * [1, 0, 1], 0.0, clip.hips[t], rotations[t], np.array([1.0, 1, 0, 0]), 0.0)
        for t in range(60)
    ]
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
        # less than half the stride
        short[:, joint] = rot.slerp(np.tile(rot.IDENTITY, (240, 1)), rotations[:, joint], 0.4)
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
    walks = [
        Pose(hips * [1, 0, 1], 0.4, hips, rotations, np.array([t % 30 < 15] * 2 + [t % 30 >= 15] * 2, float), 0.0)
        for t, (hips, rotations) in enumerate(zip(clip.hips, clip.global_rotations()))
    ]
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


# ---- styled legs that carry the body ------------------------------------------------------

STRIDE_FRAMES, STANCE = 60, 0.5  # of the walk below, and the share of it that a foot stands
SPEED = 1.0  # metres a second
NEUTRAL_HIPS = 0.93  # metres


def legs_at(
    root: np.ndarray, yaw: float, along: np.ndarray, lift: np.ndarray, hips: float, contacts: np.ndarray
) -> Pose:
    """A body upright over its root, its ankles (left, right) so far ahead and so high over where they are on flat
    feet."""
    rotations = np.tile(rot.from_yaw(yaw), (JOINT_COUNT, 1))
    pose = Pose(root, yaw, root + [0, hips, 0], rotations, np.repeat(contacts, 2), 0.0)
    beside = np.stack([[0.09, -0.09], ANKLE_HEIGHT + lift, along], axis=-1)
    return reach(pose, LEGS, root + rot.rotate(rot.from_yaw(yaw), beside), KNEES_FORWARD, 0.9995)


def walking(
    frame: int, root: np.ndarray, ratio: float, yaw: float = 0.0, hips: float = NEUTRAL_HIPS, ahead: float = 0.0
):
    """A neutral pose whose planted feet go back as fast as SPEED goes forward, and a styled one with strides `ratio` as
    long, the hips as high as that, its feet so far `ahead`."""
    u = (frame / STRIDE_FRAMES + np.array([0.0, 0.5])) % 1
    swing = np.where(u < STANCE, 1 - 2 * u / STANCE, -np.cos((u - STANCE) / (1 - STANCE) * np.pi))
    lift = np.where(u < STANCE, 0.0, 0.08 * np.sin((u - STANCE) / (1 - STANCE) * np.pi))
    along = SPEED / 60 * STRIDE_FRAMES * STANCE / 2 * swing
    contacts = (u < STANCE).astype(float)
    return (
        legs_at(root, yaw, along, lift, NEUTRAL_HIPS, contacts),
        legs_at(root, yaw, ratio * along + ahead, lift, hips, contacts),
        contacts,
    )


def carried(ratio: float, legs: float, pace: bool, frames: int = 480, **styled):
    """A session without a controller: the root goes as far as the strides carry it. The lock's strides, planted ankles'
    speeds over the floor in metres a second and the scale of each frame, both from the fourth second on."""
    lock, root, before, slides, steps = FootLock(), np.zeros(3), None, [], []
    way = rot.rotate(rot.from_yaw(styled.get("yaw", 0.0)), np.array([0.0, 0.0, 1.0]))
    for frame in range(frames):
        neutral, worn, contacts = walking(frame, root, ratio, **styled)
        feet = worn.positions[[3, 7]] + lock.stride.step(worn, neutral, np.array(legs), pace)
        if frame > 240:
            slides += [
                np.linalg.norm((feet - before[0])[foot][[0, 2]]) * 60
                for foot in (0, 1)
                if contacts[foot] and before[1][foot]
            ]
            steps.append(float(lock.stride.scale))
        before = feet, contacts
        root = root + way * SPEED / 60 * float(lock.stride.scale)
    return lock.stride, np.array(slides), np.array(steps)


@pytest.mark.parametrize("yaw", [0.0, 2.2])
@pytest.mark.parametrize("ratio", [0.6, 0.8, 1.0, 1.3])
def test_feet_of_styled_legs_do_not_slide_while_the_body_goes_as_far_as_they_carry_it(ratio, yaw):
    stride, slides, scales = carried(ratio, 1.0, True, yaw=yaw)
    assert stride.carry == pytest.approx(ratio, abs=0.03) and np.ptp(scales) < 0.02
    assert slides.max() < 0.03 and slides.mean() < 0.02, "of 0.4 that they would slide under a body that goes at SPEED"


@pytest.mark.parametrize("legs", [0.0, 0.5])
def test_legs_that_are_styled_in_part_carry_the_body_in_part(legs):
    stride, slides, scales = carried(0.6, legs, True)
    assert scales == pytest.approx(1 + legs * (stride.carry - 1), abs=0.01) and slides.max() < 0.1
    if not legs:
        assert stride.scale == 1.0, "exactly: then the controller's root is left alone"


@pytest.mark.parametrize("ratio, kept", [(0.5, MODERATE[0]), (1.6, MODERATE[1]), (0.85, 0.85)])
def test_where_the_speed_is_to_be_kept_strides_are_moderate(ratio, kept):
    stride, slides, scales = carried(ratio, 1.0, False)
    assert scales == pytest.approx(kept, abs=0.02) and slides.max() < 0.05


def test_a_style_that_walks_with_its_feet_ahead_keeps_its_stance():
    """Only how far feet swing is made to fit; where they swing about is the style's."""
    lock, root, ahead = FootLock(), np.zeros(3), []
    for frame in range(480):
        neutral, styled, _ = walking(frame, root, 0.8, ahead=0.12)
        added = lock.stride.step(styled, neutral, np.array(1.0), True)
        ahead.append((styled.positions - neutral.positions)[[3, 7], 2] + added[:, 2])
        root = root + [0, 0, SPEED / 60 * float(lock.stride.scale)]
    assert np.mean(ahead[-2 * STRIDE_FRAMES :]) == pytest.approx(0.12, abs=0.01)


def test_who_stands_is_not_moved():
    lock = FootLock()
    neutral = standing()
    styled = legs_at(np.zeros(3), 0.0, np.array([0.2, -0.1]), np.zeros(2), 0.9, np.ones(2))
    for _ in range(60):
        added = lock.stride.step(styled, neutral, np.array(1.0), True)
    assert np.abs(added).max() < 1e-12


def knees(pose: Pose) -> np.ndarray:
    """(2,) degrees that they are bent."""
    thigh, shin = (pose.positions[b] - pose.positions[a] for a, b in (([1, 5], [2, 6]), ([2, 6], [3, 7])))
    return np.degrees(np.arccos(np.vecdot(rot.normalize(thigh), rot.normalize(shin))))


@pytest.mark.parametrize("floating", [-0.06, 0.0, 0.08])
def test_a_crouched_body_stands_at_its_own_height(floating):
    """However high the network put its hips: feet on the floor, knees as bent as the style bends them."""
    neutral, crouch = standing(), 0.76
    styled = legs_at(np.zeros(3), 0.0, np.array([0.1, -0.1]), np.zeros(2), crouch, np.ones(2))
    lock = FootLock()
    lifted = styled.with_body(styled.hips + [0, floating, 0], styled.rotations)
    for _ in range(120):
        locked = lock.step(lifted, neutral, np.ones(2))
    assert locked.hips[1] == pytest.approx(crouch, abs=0.004)
    assert locked.positions[[4, 8], 1] == pytest.approx(TOE_HEIGHT, abs=0.004)
    np.testing.assert_allclose(knees(locked), knees(styled), atol=1.5)
    assert knees(styled).min() > 50


@pytest.mark.parametrize("hips", [0.78, 0.95])
def test_a_walk_keeps_the_hips_height_of_the_style_on_feet_that_are_planted(hips):
    """A crouch walks on bent knees, and who walks on straight ones does not sink: the hips are where the styled legs
    put them."""
    lock, root, heights, slides, before = FootLock(), np.zeros(3), [], [], None
    for frame in range(360):
        neutral, styled, contacts = walking(frame, root, 0.8, hips=hips)
        styled = styled.with_body(styled.hips + [0, 0.05, 0], styled.rotations)  # the network is wrong about the floor
        locked = lock.step(styled, neutral, np.ones(2), True)
        if frame > 240:
            heights.append(locked.hips[1])
            assert locked.positions[CONTACT_JOINTS, 1].min() > 0.5 * TOE_HEIGHT
            slides += [
                np.linalg.norm((locked.positions - before[0].positions)[(3, 7)[foot], ::2])
                for foot in (0, 1)
                if contacts[foot] and before[1][foot]
            ]
        before = locked, contacts
        root = root + [0, 0, SPEED / 60 * float(lock.stride.scale)]
    assert np.mean(heights) == pytest.approx(hips, abs=0.012) and np.ptp(heights) < 0.02
    assert np.max(slides) * 60 < 0.03


def test_legs_without_a_style_stand_where_the_neutral_ones_do():
    """A leaning spine alone moves the hips: they come back to the neutral legs' height."""
    neutral = standing()
    raised = neutral.with_body(neutral.hips + [0, 0.05, 0], neutral.rotations)
    lock = FootLock()
    for _ in range(120):
        locked = lock.step(raised, neutral)
    np.testing.assert_allclose(locked.positions, neutral.positions, atol=0.003)


def test_a_foot_that_the_style_lifts_is_not_pinned_to_the_floor():
    """Contacts are the neutral feet's; a styled leg may be in the air where the neutral one stands."""
    neutral, lock = standing(), FootLock()
    styled = legs_at(np.zeros(3), 0.0, np.zeros(2), np.array([0.0, 0.2]), 0.93, np.ones(2))
    for _ in range(120):
        locked = lock.step(styled, neutral, np.ones(2))
    assert locked.positions[7, 1] - locked.positions[3, 1] > 0.17 and locked.contacts[2:].max() == 0.0
    assert locked.positions[4, 1] == pytest.approx(TOE_HEIGHT, abs=0.006)


def test_styled_legs_of_a_crowd_are_locked_each_as_alone():
    """Strengths and pace of their own."""
    scripts = [
        (0.6, np.ones(2), True, {}),
        (1.2, np.array([1.0, 0.3]), False, {"hips": 0.85}),
        (0.8, np.zeros(2), True, {}),
    ]
    crowd, alone = FootLock(), [FootLock() for _ in scripts]
    for frame in range(120):
        poses = [walking(frame, np.array([0, 0, 0.01 * frame]), ratio, **more)[:2] for ratio, *_, more in scripts]
        neutral, styled = (Pose.stacked(each) for each in zip(*poses))
        locked = crowd.step(
            styled,
            neutral,
            legs=np.array([legs for _, legs, *_ in scripts]),
            pace=np.array([pace for *_, pace, _ in scripts]),
        )
        for one, (lock, (own, worn), (_, legs, pace, _)) in enumerate(zip(alone, poses, scripts)):
            np.testing.assert_allclose(locked[one].positions, lock.step(worn, own, legs, pace).positions, atol=1e-9)


def test_a_foot_that_pushes_off_is_not_pulled_down():
    """Feet whose toes alone bear, and rise by 2 cm: flat ones would be brought to the floor, these go with the legs."""
    lifts = np.linspace(0.0, 0.02, 30)
    rolling, flat = (
        run([standing(lift=lift, contacts=contacts) for lift in lifts]) for contacts in ((0, 1, 0, 1), (1, 1, 1, 1))
    )
    assert flat[-1].positions[CONTACT_JOINTS[1], 1] < TOE_HEIGHT + 0.012
    np.testing.assert_allclose(rolling[-1].positions[CONTACT_JOINTS[1], 1], TOE_HEIGHT + 0.02, atol=0.001)
    np.testing.assert_allclose(rolling[-1].hips, standing(lift=0.02).hips, atol=0.001)


def test_a_foot_is_held_once_it_is_down():
    """Feet that are said to stand 10 cm over ground that goes down: they come down, and until then go along."""
    lock = FootLock(Ground(np.full((2, 2), -0.1), 1.0))
    poses = [standing(0.008 * frame) for frame in range(16)]
    locked = [lock.step(pose, pose) for pose in poses]
    heights = np.array([pose.positions[CONTACT_JOINTS, 1] for pose in locked]) + 0.1
    contacts = np.array([pose.contacts for pose in locked])
    assert contacts[0].max() == 0 and contacts[-1].min() == 1
    assert heights[contacts > 0.5].max() < ANKLE_HEIGHT + 0.03
    slid = np.array([pose.positions[3, 0] for pose in locked])
    assert slid[3] - slid[0] > 0.02 and abs(slid[-1] - slid[-5]) < 1e-3
