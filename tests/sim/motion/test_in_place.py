"""Clips that walk in place get their travel back; all others come back as they are."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sim.body.skeleton import INDEX
from sim.math import rotations as rot
from sim.math.vectors import FLOOR
from sim.motion.clip import FPS, Clip, root_frame
from sim.motion.in_place import restore_travel
from sim.retarget.retarget import load_clip
from tests.support.walker import CYCLE, planted_clip, walking_clip

LOOPS = Path(os.environ.get("PATCHWALK_LOOPS", "/data/cc0-quaternius/cc0-quaternius"))  # made for the treadmill


def striding_clip(frames: int = 4 * CYCLE + 1, yaw: float = 0.0) -> Clip:
    """Walks along `yaw`; each foot in turn is lifted for half a cycle while the body goes so that the other stands."""
    t = np.arange(frames)
    clip = replace(planted_clip(frames), rotations=walking_clip(frames).rotations)
    for side, shift in (("Left", 0.0), ("Right", np.pi)):
        phase = 2 * np.pi * t / CYCLE + shift
        across = np.tile([1.0, 0.0, 0.0], (frames, 1))
        swing = np.arcsin(np.clip(2 / np.pi * np.arcsin(np.cos(phase)), -1, 1) * 0.33)  # goes back at a steady rate
        lift = np.maximum(np.sin(phase), 0.0) ** 2
        clip.rotations[:, INDEX[side + "UpLeg"]] = rot.from_axis_angle(across, swing - 0.3 * lift)
        clip.rotations[:, INDEX[side + "Leg"]] = rot.from_axis_angle(across, 0.8 * lift)
        clip.rotations[:, INDEX[side + "Foot"]] = rot.from_axis_angle(across, -swing - 0.5 * lift)
    toes = clip.positions()[:, [INDEX["LeftToe"], INDEX["RightToe"]]]
    planted = (t[:-1] % CYCLE < CYCLE / 2).astype(int)  # the right foot while the left one is lifted
    step = np.diff(toes, axis=0)[t[:-1], planted] * FLOOR
    hips = clip.hips - np.concatenate([np.zeros((1, 3)), np.cumsum(step, axis=0)])
    turn = rot.from_yaw(np.full(frames, yaw))
    clip.rotations[:, 0] = turn
    return replace(clip, hips=rot.rotate(turn, hips)).grounded()


def on_the_spot(clip: Clip) -> Clip:
    """Without the travel, as a treadmill takes it away: at one speed."""
    share = np.linspace(0, 1, len(clip))[:, None]
    return replace(clip, hips=clip.hips - share * (clip.hips[-1] - clip.hips[0]) * FLOOR)


def velocity(clip: Clip) -> np.ndarray:
    """The root's mean velocity (3,) in metres a second."""
    root = root_frame(clip.positions(), clip.fps).positions
    return (root[-1] - root[0]) * clip.fps / (len(clip) - 1)


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_travel_that_was_taken_out_comes_back(yaw):
    walk = striding_clip(yaw=yaw)
    treadmill = on_the_spot(walk)
    assert np.linalg.norm(velocity(treadmill)) < 0.05
    restored = restore_travel(treadmill)
    assert np.linalg.norm(velocity(restored) - velocity(walk)) < 0.1 * np.linalg.norm(velocity(walk))
    assert restored.rotations is treadmill.rotations


def test_a_walk_backwards_goes_backwards():
    walk = striding_clip()
    back = replace(walk, hips=walk.hips[::-1], rotations=walk.rotations[::-1])
    assert velocity(restore_travel(on_the_spot(back)))[2] == pytest.approx(velocity(back)[2], rel=0.1)


def test_a_loop_is_repeated_and_goes_on():
    loop = on_the_spot(striding_clip(CYCLE + 1))
    long = restore_travel(loop, seconds=5.0)
    assert len(long) == 5 * CYCLE
    np.testing.assert_allclose(velocity(long), velocity(restore_travel(loop)), atol=0.05)
    forward = np.diff(long.hips[:, 2]) * FPS
    assert forward.min() > 0 and np.abs(np.diff(forward)).max() < 0.3  # no jump where it begins anew
    assert len(restore_travel(loop[:-20], seconds=5.0)) == len(loop) - 20, "does not end as it began: no loop"


def test_what_travels_stands_or_steps_on_the_spot_is_not_touched():
    walk = striding_clip()
    stepping = planted_clip(240)  # the thighs are lifted, one after the other, over feet that stay in their place
    swing = np.sin(2 * np.pi * np.arange(240) / CYCLE)[:, None]
    for side, sign in (("Left", 1), ("Right", -1)):
        bend = np.maximum(sign * swing, 0) * [1.0, 0.0, 0.0]
        stepping.rotations[:, INDEX[side + "UpLeg"]] = rot.from_rotation_vector(-0.5 * bend)
        stepping.rotations[:, INDEX[side + "Leg"]] = rot.from_rotation_vector(1.0 * bend)
    swaying = planted_clip(240)
    swaying = replace(swaying, hips=swaying.hips + 0.05 * swing * [1.0, 0.0, 0.0])
    for clip in (walk, walking_clip(), planted_clip(), stepping, swaying, walk[:1]):
        assert restore_travel(clip) is clip
        assert restore_travel(clip, seconds=10.0) is clip


@pytest.mark.skipif(not LOOPS.exists(), reason=f"{LOOPS} is not there")
@pytest.mark.parametrize(
    "name, slowest, fastest",
    [
        ("Walk_Loop", 0.8, 1.2),
        ("Push_Loop", 0.2, 0.5),
        ("Crouch_Fwd_Loop", 0.5, 0.9),
        ("Jog_Fwd_Loop", 4.0, 6.5),
        ("Idle_Loop", 0, 0),
        ("Dizzy", 0, 0),
        ("Swim_Fwd_Loop", 0, 0),
        ("Jump_Land", 0, 0),
    ],
)
def test_made_loops(name, slowest, fastest):
    clip = load_clip(LOOPS / f"{name}.bvh")
    restored = restore_travel(clip)
    if not fastest:
        assert restored is clip
    else:
        assert slowest < velocity(restored)[2] < fastest
        assert abs(velocity(restored)[0]) < 0.1
