"""The idle loop on a sway whose amplitude is known."""

import numpy as np
import pytest

from controller.model.idle_layer import LIVELIER, SECONDS, SHAPE, Idle, fit
from controller.training.dataset import frames_of
from controller.training.labelled_clip import label
from sim.body.skeleton import INDEX, JOINT_COUNT
from sim.math import rotations as rot
from sim.motion.clip import FPS, Clip
from tests.support.walker import planted_clip, walking_clip

HEAD = INDEX["Head"]
STANDING = np.tile(rot.IDENTITY, (JOINT_COUNT, 1))


def swaying_clip(seconds: int = SECONDS + 4, amplitude: float = 0.05) -> Clip:
    clip = planted_clip(seconds * FPS)
    rotations = clip.rotations.copy()
    angle = amplitude * np.cos(2 * np.pi * 2 * np.arange(len(clip)) / FPS / SECONDS)  # twice in a loop, without drift
    rotations[:, HEAD] = rot.from_axis_angle(np.tile([1.0, 0, 0], (len(clip), 1)), angle)
    hips = clip.hips + np.array([0.001, 0, 0]) * np.sin(2 * np.pi * np.arange(len(clip)) / FPS / 7)[:, None]
    return Clip(hips, rotations)


def test_the_loop_gives_back_the_captured_sway():
    inputs, targets, _ = frames_of(label(swaying_clip()))
    idle = Idle(fit(inputs, targets, np.zeros(len(inputs), int)))
    rotations = np.array([idle.step(1.0, STANDING)[0] for _ in range(4 * SECONDS * FPS)])[2 * SECONDS * FPS :]
    vectors = rot.to_rotation_vector(rotations)
    assert np.ptp(vectors[:, HEAD, 0]) / 2 == pytest.approx(0.05 * LIVELIER, rel=0.05)
    np.testing.assert_allclose(vectors[: SECONDS * FPS], vectors[SECONDS * FPS :], atol=1e-6)  # a loop
    assert np.abs(vectors[:, INDEX["LeftHand"]]).max() < 0.005


def test_it_fades_when_the_character_moves_and_walking_teaches_nothing():
    inputs, targets, _ = frames_of(label(walking_clip(800).grounded()))
    assert not fit(inputs, targets, np.zeros(len(inputs), int)).any()
    idle = Idle(np.ones(SHAPE))
    for standing in (1.0, 0.0):
        for _ in range(918):
            rotations, shift = idle.step(standing, STANDING)
        assert (np.abs(shift).max() > 1e-3) == (standing == 1.0)
    np.testing.assert_array_equal(rotations, STANDING)


def test_nothing_sways_quicker_than_once_a_second():
    idle = Idle(np.ones(SHAPE))
    shifts = np.array([idle.step(1.0, STANDING)[1] for _ in range(3 * SECONDS * FPS)])[-SECONDS * FPS :]
    strength, hertz = np.abs(np.fft.rfft(shifts, axis=0)).max(axis=1), np.fft.rfftfreq(len(shifts), 1 / FPS)
    assert strength[hertz > 1.0].max() < 1e-6 * strength.max() > 0


def test_spine_and_arms_come_to_the_captured_bearing_and_the_legs_stand_as_they_stood():
    bearing = np.zeros(SHAPE)
    bearing[0, :, 0] = 0.3
    idle = Idle(bearing)
    for _ in range(20 * FPS):
        rotations, _ = idle.step(1.0, STANDING)
    np.testing.assert_allclose(rot.to_rotation_vector(rotations)[HEAD], (0.3, 0, 0), atol=1e-3)
    np.testing.assert_array_equal(rotations[[INDEX["Hips"], INDEX["LeftLeg"]]], STANDING[:2])
