"""What is not locked to the stride: known answers on a walk whose arm and head move as a formula says."""

from dataclasses import replace

import numpy as np
import pytest

from sim.body.skeleton import INDEX, JOINT_COUNT, PARTS
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.motion.features import STRIDE, clip_features
from sim.motion.gait import cycle_at, fit_cycle
from stylizer.styles.stride_residual import (
    CROSS_FADE,
    JOINTS,
    LONGEST_LOOP,
    play_residual,
    rest_unsure_joints,
    stride_locked_part,
    stride_residual,
)
from tests.support.walker import CYCLE, planted_clip, walking_clip

ARM, HEAD = INDEX["LeftForeArm"], INDEX["Head"]
OWN_TIME = 0.37  # Hz, of a movement that has nothing to do with the stride
FADED = round(CROSS_FADE * FPS / STRIDE)  # samples at the loop's beginning that are faded into its end


def moving(frames: int, joint: int, angle: np.ndarray, clip=walking_clip):
    """Features of a walk with one more joint that turns about the vertical."""
    walk = clip(frames)
    rotations = walk.rotations.copy()
    rotations[:, joint] = rot.from_axis_angle(np.tile([0.0, 1.0, 0.0], (frames, 1)), angle)
    return clip_features(replace(walk, rotations=rotations))


def test_what_is_locked_to_the_stride_leaves_nothing():
    time = np.arange(480)
    stride = 2 * np.pi * time / CYCLE
    loop = stride_residual(moving(480, ARM, 0.5 * np.sin(stride) + 0.2 * np.cos(3 * stride + 0.4)))
    assert loop.shape[1:] == (JOINT_COUNT, 3) and np.abs(loop).max() < 0.02


def test_what_moves_in_its_own_time_comes_back():
    time = np.arange(600) / FPS
    angle = 0.4 * np.sin(2 * np.pi * OWN_TIME * time)
    loop = stride_residual(moving(600, HEAD, angle + 0.3))
    wanted = (angle - angle.mean())[::STRIDE][: len(loop)]
    np.testing.assert_allclose(loop[FADED + 3 : -3, HEAD, 1], wanted[FADED + 3 : -3], atol=0.06)
    assert np.corrcoef(loop[FADED:, HEAD, 1], wanted[FADED:])[0, 1] > 0.99
    assert np.abs(loop[:, HEAD, [0, 2]]).max() < 0.02, "about its own axis"
    assert np.abs(loop[:, ARM]).max() < 0.02, "of its own joint"


def test_both_at_once_are_told_apart():
    time = np.arange(600) / FPS
    stride = 2 * np.pi * time * FPS / CYCLE
    loop = stride_residual(moving(600, ARM, 0.5 * np.sin(stride) + 0.3 * np.sin(2 * np.pi * OWN_TIME * time)))
    assert loop[:, ARM, 1].std() == pytest.approx(0.3 / np.sqrt(2), rel=0.15)
    spectrum = np.abs(np.fft.rfft(loop[:, ARM, 1]))
    hertz = np.fft.rfftfreq(len(loop), STRIDE / FPS)
    assert hertz[spectrum.argmax()] == pytest.approx(OWN_TIME, abs=0.15)


def test_who_makes_no_strides_moves_about_the_mean():
    time = np.arange(480) / FPS
    angle = 0.4 * np.sin(2 * np.pi * time)
    loop = stride_residual(moving(480, HEAD, angle, planted_clip))
    np.testing.assert_allclose(loop[FADED + 3 : -3, HEAD, 1], angle[::STRIDE][FADED + 3 : len(loop) - 3], atol=0.05)


def test_legs_and_hips_carry_the_body_and_are_left_alone():
    features = moving(480, INDEX["LeftUpLeg"], 0.5 * np.sin(np.arange(480) / 11))
    loop = stride_residual(features)
    legs = [0, *PARTS["left_leg"], *PARTS["right_leg"]]
    assert not loop[:, legs].any() and set(JOINTS) == set(range(JOINT_COUNT)) - set(legs)


@pytest.mark.parametrize("frames, hertz", [(600, 0.37), (400, 0.61), (300, 0.23)])
def test_the_loop_has_no_seam(frames, hertz):
    """Neither a jump nor a kink, where it begins again, that is larger than elsewhere in it."""
    loop = stride_residual(moving(frames, HEAD, 0.6 * np.sin(2 * np.pi * hertz * np.arange(frames) / FPS)))[:, HEAD, 1]
    assert np.ptp(loop) > 0.5
    around = np.concatenate([loop[-4:], loop[:4]])
    for order in (1, 2):
        inside = np.abs(np.diff(loop, order)).max()
        assert np.abs(np.diff(around, order)).max() <= 1.05 * inside


def test_a_clip_too_short_for_a_loop_has_none_and_a_long_one_is_cut():
    assert stride_residual(clip_features(walking_clip(149))) is None
    assert stride_residual(clip_features(walking_clip(150))) is not None
    assert len(stride_residual(clip_features(walking_clip(1500)))) == round(LONGEST_LOOP * FPS / STRIDE) - FADED


def test_a_loop_is_played_at_60_hz_round_and_round():
    time = np.arange(90)
    loop = np.sin(2 * np.pi * time / 30)[:, None] * np.array([1.0, -2.0])
    for frame in (0, 2, 178, 180, 542):
        np.testing.assert_array_equal(play_residual(loop, frame), loop[frame // STRIDE % 90])
    between = np.array([play_residual(loop, frame) for frame in range(360)])
    np.testing.assert_allclose(between[:, 0], np.sin(2 * np.pi * np.arange(360) / 60), atol=2e-3)
    np.testing.assert_array_equal(between[:180], between[180:])


def test_the_locked_part_without_strides_is_the_mean():
    signal = np.random.default_rng(0).normal(size=(50, 3))
    np.testing.assert_array_equal(stride_locked_part(signal, None), np.broadcast_to(signal.mean(axis=0), (50, 3)))


def test_a_joint_that_turns_all_round_in_its_own_time_rests_in_the_cycle():
    """Its mean axes all but cancel: as a cycle they would turn over where they pass through nothing."""
    phase = np.linspace(0, 10 * np.pi, 600)
    turns = np.zeros((600, JOINT_COUNT, 3))
    turns[:, 1, 0] = 0.5 * np.sin(phase)
    turns[:, 2, 0] = 1.9 * np.sin(0.37 * phase) + 0.3 * np.sin(phase)
    cycle = fit_cycle(rot.to_6d(rot.from_rotation_vector(turns)), phase)
    steady = rest_unsure_joints(cycle)
    assert np.linalg.norm(cycle_at(cycle, phase)[:, 2, :3], axis=-1).min() < 0.3
    assert not steady[1:, 2].any()
    np.testing.assert_allclose(np.linalg.norm(steady[0, 2].reshape(2, 3), axis=-1), 1.0)
    np.testing.assert_array_equal(steady[:, [0, 1]], cycle[:, [0, 1]])
