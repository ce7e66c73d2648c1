"""Joints told by the skeleton's shape where names say nothing: of people, whichever way they face; of nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from sim.body.skeleton import INDEX, JOINT_COUNT, JOINTS
from sim.io import bvh
from sim.math import rotations as rot
from sim.retarget import joint_shape
from sim.retarget.retarget import retarget
from tests.sim.retarget.test_retarget import LEFT, along_bones, dressed, exercise, plain

NUMBERED = tuple(f"bone{number:02}" for number in range(len(JOINTS)))


@pytest.mark.parametrize("frames", [plain, along_bones])
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_a_person_without_names_is_told_by_shape_with_a_warning(frames, yaw):
    clip = exercise()
    turned = replace(clip, rotations=clip.rotations.copy())
    turned.rotations[:, 0] = rot.multiply(rot.from_yaw(yaw), clip.rotations[:, 0])
    motion = dressed(turned, frames(), names=NUMBERED)
    guess = joint_shape.guess_joints(motion)
    assert guess.name_map == dict(zip(JOINTS, NUMBERED)) and guess.sure > 0.8
    with pytest.warns(UserWarning, match=r"told by the skeleton's shape, \d\d% sure: Hips is bone00, .*--map FILE"):
        back = retarget(motion)
    np.testing.assert_allclose(back.positions(), turned.positions(), atol=0.01)


def test_fingers_a_tail_and_the_top_of_the_head_do_not_mislead():
    motion = dressed(exercise(), plain(), names=NUMBERED)
    frames = len(motion)
    more = {
        "LeftHand": [(8.0, 0, 2), (4.0, 0, 0), (3.0, 0, 0)],
        "RightHand": [(-8.0, 0, 2), (-4.0, 0, 0), (-3.0, 0, 0)],
        "Hips": [(0.0, 0, -15), (0.0, 0, -15), (0.0, 0, -15)],
        "Head": [(0.0, 18, 0)],
    }
    names, parents, offsets = list(motion.names), list(motion.parents), [motion.offsets]
    for joint, chain in more.items():
        parent = INDEX[joint]
        for offset in chain:
            names.append(f"bone{len(names)}")
            parents.append(parent)
            offsets.append(np.array([offset]))
            parent = len(names) - 1
    added = np.concatenate(offsets[1:])
    motion = replace(
        motion,
        names=names,
        parents=parents,
        offsets=np.concatenate(offsets),
        positions=np.concatenate([motion.positions, np.tile(added, (frames, 1, 1))], axis=1),
        rotations=np.concatenate([motion.rotations, np.tile(rot.IDENTITY, (frames, len(added), 1))], axis=1),
    )
    assert joint_shape.guess_joints(motion).name_map == dict(zip(JOINTS, NUMBERED))


def test_braids_are_no_arms():
    motion = dressed(exercise(), plain(), names=NUMBERED)
    head, frames = INDEX["Head"], len(motion)
    braid = np.array([(8.0, 6.0, -2.0), (12.0, -16.0, 2.0), (2.0, -20.0, -6.0), (0.0, -10.0, 0.0)])
    offsets = np.concatenate([braid, braid * (-1, 1, 1)])
    parents = [head if place in (0, 4) else JOINT_COUNT + place - 1 for place in range(8)]
    motion = replace(
        motion,
        names=[*motion.names, *(f"hair{place}" for place in range(8))],
        parents=[*motion.parents, *parents],
        offsets=np.concatenate([motion.offsets, offsets]),
        positions=np.concatenate([motion.positions, np.tile(offsets, (frames, 1, 1))], axis=1),
        rotations=np.concatenate([motion.rotations, np.tile(rot.IDENTITY, (frames, 8, 1))], axis=1),
    )
    assert joint_shape.guess_joints(motion).name_map == dict(zip(JOINTS, NUMBERED))


def chain(joints: int) -> bvh.Motion:
    """A rope of so many joints."""
    positions = np.tile([0.0, 10.0, 0.0], (30, joints, 1))
    turns = rot.from_axis_angle(np.tile(LEFT, (30, joints, 1)), np.linspace(0, 0.3, 30)[:, None] * np.ones(joints))
    names = [f"bone{number}" for number in range(joints)]
    return bvh.Motion(names, list(range(-1, joints - 1)), positions[0], {}, [()] * joints, 30, positions, turns)


def test_a_prop_is_refused_by_its_names():
    with pytest.raises(ValueError, match="this skeleton is not known: no joint found for Hips"):
        retarget(chain(20))
    assert joint_shape.guess_joints(chain(20)) is None


def test_a_body_whose_arms_are_as_long_as_no_person_has_is_refused():
    motion = dressed(exercise(), plain(), names=NUMBERED)
    for side in ("Left", "Right"):
        for name in ("ForeArm", "Hand"):
            motion.positions[:, INDEX[side + name]] *= 3.0
    assert joint_shape.guess_joints(motion) is None
