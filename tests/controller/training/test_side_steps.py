"""Side-steps that cross the feet are left out of a clip; everything else of it stays."""

from dataclasses import replace

import numpy as np
import pytest

from controller.training.side_steps import find_uncrossed
from sim.body.skeleton import INDEX
from sim.math import rotations as rot
from sim.math.vectors import FORWARD
from sim.motion.clip import FPS, Clip
from tests.support.walker import planted_clip

FRAMES, SPEED = 360, 0.8  # metres a second


def side_stepping(crossing: slice, turn_rate: float = 0.0) -> Clip:
    """A stiff body carried to its left at SPEED; while `crossing`, each leg leans over to the other side."""
    clip = planted_clip(FRAMES)
    facing = rot.from_yaw(turn_rate * np.arange(FRAMES) / FPS)
    rotations = clip.rotations.copy()
    rotations[:, 0] = facing
    for side, angle in (("Left", -20), ("Right", 20)):
        rotations[crossing, INDEX[side + "UpLeg"]] = rot.from_rotation_vector(np.radians(angle) * FORWARD)
    left = rot.rotate(facing, np.array([SPEED / FPS, 0.0, 0.0]))
    return replace(clip, hips=clip.hips + np.cumsum(left, axis=0), rotations=rotations)


def test_side_steps_without_crossing_are_learned_whole():
    assert find_uncrossed(side_stepping(slice(0, 0)), 0.7) == [slice(0, FRAMES)]


def test_one_crossed_step_takes_its_side_stepping_along():
    assert find_uncrossed(side_stepping(slice(100, 130)), 0.7) == []


def test_before_and_after_the_side_stepping_the_clip_is_learned():
    clip = side_stepping(slice(100, 130))
    stand = np.clip(np.arange(FRAMES), 90, 150)
    start, stop = (part.stop - part.start for part in find_uncrossed(replace(clip, hips=clip.hips[stand]), 0.7))
    assert start == pytest.approx(90, abs=15) and stop == pytest.approx(FRAMES - 150, abs=15)
    assert find_uncrossed(replace(clip, hips=clip.hips[stand]), 2.0) == [slice(FRAMES - stop, FRAMES)]


def test_feet_that_cross_in_a_turn_or_on_the_spot_are_learned():
    turning = side_stepping(slice(100, 130), turn_rate=1.5)
    assert find_uncrossed(turning, 0.7) == [slice(0, FRAMES)]
    clip = side_stepping(slice(100, 130))
    assert find_uncrossed(replace(clip, hips=clip.hips[:1].repeat(FRAMES, axis=0)), 0.7) == [slice(0, FRAMES)]
