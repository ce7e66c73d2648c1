"""Loops of steady running from a synthetic run whose cycle is known."""

from dataclasses import replace

import numpy as np
import pytest

from controller.training.cyclic_runs import SECONDS, TURN_RATES, find_loops
from sim.motion.clip import FPS, root_frame
from tests.support.walker import CYCLE, walking_clip


def running_clip(frames: int = 140):
    """The synthetic walk at twice its pace: 2.4 m/s, two steps in half a second, a little over four cycles."""
    walk = walking_clip(2 * frames).grounded()
    return walk.paced(2.0)


def test_a_loop_goes_on_as_the_cycle_does_along_every_way():
    clip = running_clip()
    speed = np.linalg.norm(np.diff(root_frame(clip.positions()).positions[[0, -1]], axis=0)) * FPS / (len(clip) - 1)
    made = find_loops(clip)
    assert len(made) == len(TURN_RATES)
    for loop, rate in zip(made, TURN_RATES):
        assert len(loop) == round(SECONDS * FPS)
        root = root_frame(loop.positions())
        steps = np.linalg.norm(np.diff(root.positions, axis=0), axis=1)[20:-20] * FPS
        np.testing.assert_allclose(steps, speed, rtol=0.05)
        turned = (root.facing[-20] - root.facing[20]) / (len(loop) - 40) * FPS
        assert turned == pytest.approx(rate, abs=0.02)


def test_a_loop_repeats_its_cycle_without_a_jump():
    loop = find_loops(running_clip())[0]
    root = root_frame(loop.positions())
    local = loop.positions() - root.positions[:, None]
    step = np.linalg.norm(np.diff(local, axis=0), axis=-1).max(axis=1)
    assert step.max() < 1.5 * np.percentile(step, 95)
    np.testing.assert_allclose(local[20], local[20 + CYCLE // 2 * 2], atol=0.03)


def test_what_does_not_run_straight_or_does_not_close_makes_no_loop():
    assert find_loops(walking_clip(240).grounded()) == [], "a walk"
    clip = running_clip()
    sideways = replace(clip, hips=clip.hips[:, [2, 1, 0]])
    assert find_loops(sideways) == []
    assert find_loops(clip[:20]) == [], "shorter than a cycle"
