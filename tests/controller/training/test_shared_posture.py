"""Actors who differ by constant turns of their joints come to walk alike, and their legs stay where they were
captured."""

from dataclasses import replace

import numpy as np

from controller.training.shared_posture import SHORTEST_WALK, UPPER, measure_walk, median_rotations, share_posture
from sim.body.kinematics import to_local
from sim.body.skeleton import INDEX, JOINT_COUNT, PART_OF_JOINT
from sim.math import rotations as rot
from tests.support.walker import walking_clip

LEGS = np.flatnonzero(PART_OF_JOINT < 2)
TURNED = [INDEX[f"{side}{joint}"] for side in ("Left", "Right") for joint in ("Arm", "ForeArm", "Hand")] + [
    INDEX["Head"]
]


def of_another_actor(clip, random: np.random.Generator, angle: float):
    """The clip with every joint that the facing does not depend on turned, in its own axes, by a constant of about that
    angle in radians."""
    turns = rot.from_rotation_vector(random.normal(size=(JOINT_COUNT, 3)) * angle / 3)
    rotations = clip.global_rotations().copy()
    rotations[:, TURNED] = rot.multiply(rotations[:, TURNED], turns[TURNED])
    return replace(clip, rotations=to_local(rotations))


def angles_between(one, other) -> np.ndarray:
    """(frames, 21) radians between the global rotations of two clips."""
    turn = rot.multiply(one.global_rotations(), rot.inverse(other.global_rotations()))
    return rot.length(rot.to_rotation_vector(turn))[..., 0]


def test_actors_come_to_walk_in_one_posture_and_their_feet_stay():
    random = np.random.default_rng(0)
    walk = walking_clip(2 * SHORTEST_WALK).grounded()
    clips = [of_another_actor(walk, random, angle) for angle in (0.1, 0.8, 1.5)]
    assert angles_between(clips[0], clips[2])[:, UPPER].max() > 0.8
    shared = share_posture(clips, ["one", "two", "three"])
    for clip, before in zip(shared, clips):
        assert angles_between(clip, shared[0])[:, UPPER].max() < 0.02
        assert angles_between(clip, before)[:, LEGS].max() < 1e-6
        np.testing.assert_allclose(clip.positions()[:, LEGS], before.positions()[:, LEGS], atol=0.01)


def test_the_clips_of_one_actor_turn_alike_whether_they_walk_or_not():
    random = np.random.default_rng(1)
    walk = walking_clip(2 * SHORTEST_WALK).grounded()
    other = of_another_actor(walk, random, 1.0)
    stand = replace(
        walk,
        hips=np.repeat(walk.hips[:1], len(walk), axis=0),
        rotations=np.repeat(walk.rotations[:1], len(walk), axis=0),
    )
    assert not measure_walk(stand).frames.any()
    shared = share_posture([walk, stand, other, stand], ["a", "a", "b", "never walks"])
    np.testing.assert_allclose(
        angles_between(shared[0][:1], walk[:1]), angles_between(shared[1][:1], stand[:1]), atol=1e-6
    )
    assert shared[3] is stand
    alone = share_posture([walk], ["a"])
    assert alone[0] is walk, "one actor has nobody to share with"


def test_an_odd_rotation_does_not_move_the_median():
    near = rot.from_rotation_vector(np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.12], [0.0, 0.0, 0.11], [2.0, 0.0, 0.0]]))
    median = rot.to_rotation_vector(median_rotations(np.repeat(near[:, None], JOINT_COUNT, axis=1)))
    np.testing.assert_allclose(median[INDEX["Head"]], [0.0, 0.0, 0.11], atol=0.03)


def test_who_backs_with_the_head_down_holds_it_as_while_walking_on():
    walk = walking_clip(2 * SHORTEST_WALK).grounded()
    bowed = walk.global_rotations().copy()
    head = INDEX["Head"]
    bowed[:, head] = rot.multiply(bowed[:, head], rot.from_rotation_vector(np.array([0.6, 0.0, 0.0])))
    back = replace(walk, rotations=to_local(bowed))[::-1]
    other = of_another_actor(walk, np.random.default_rng(2), 0.5)
    shared = share_posture([walk, back, other], ["a", "a", "b"])
    middle = slice(60, -60)
    apart = angles_between(shared[1][::-1][middle], shared[0][middle])[:, head]
    assert apart.max() < 0.1 and angles_between(back[::-1], walk)[:, head].min() > 0.5
