"""The idle loop on a sway whose amplitude is known."""

import numpy as np
import pytest

from controller.dataset import frames_of
from controller.idle import HARMONICS, SECONDS, SHAPE, Idle, fit
from sim import rotations as rot
from sim.clip import FPS, Clip
from sim.skeleton import INDEX, JOINT_COUNT
from tests.sim.walker import planted_clip, walking_clip

HEAD = INDEX["Head"]


def swaying_clip(seconds: int = SECONDS + 4, amplitude: float = 0.05) -> Clip:
    clip = planted_clip(seconds * FPS)
    rotations = clip.rotations.copy()
    angle = amplitude * np.cos(2 * np.pi * 2 * np.arange(len(clip)) / FPS / SECONDS)  # twice in a loop, without drift
    rotations[:, HEAD] = rot.from_axis_angle(np.tile([1.0, 0, 0], (len(clip), 1)), angle)
    hips = clip.hips + np.array([0.001, 0, 0]) * np.sin(2 * np.pi * np.arange(len(clip)) / FPS / 7)[:, None]
    return Clip(hips, rotations)


def test_the_loop_gives_back_the_captured_sway():
    inputs, targets, _ = frames_of(swaying_clip())
    idle = Idle(fit(inputs, targets, np.zeros(len(inputs), int)))
    turns = np.array([idle.step(1.0)[0] for _ in range(3 * SECONDS * FPS)])[SECONDS * FPS:]
    vectors = rot.to_rotation_vector(turns)
    assert np.ptp(vectors[:, HEAD, 0]) / 2 == pytest.approx(0.05, rel=0.05)
    np.testing.assert_allclose(vectors[:SECONDS * FPS], vectors[SECONDS * FPS:], atol=1e-6)  # a loop
    assert np.abs(vectors[:, INDEX["LeftHand"]]).max() < 0.005


def test_it_fades_when_the_character_moves_and_walking_teaches_nothing():
    inputs, targets, _ = frames_of(walking_clip(800).grounded())
    assert not fit(inputs, targets, np.zeros(len(inputs), int)).any()
    idle = Idle(np.ones(SHAPE))
    for standing in (1.0, 0.0):
        for _ in range(318):
            turns, shift = idle.step(standing)
        assert (np.abs(shift).max() > 1e-3) == (standing == 1.0)
    np.testing.assert_allclose(turns, np.tile(rot.IDENTITY, (JOINT_COUNT, 1)), atol=1e-3)
    assert HARMONICS < SECONDS  # nothing quicker than 1 Hz
