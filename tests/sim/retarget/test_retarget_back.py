"""A restyled clip back on its own skeleton: nothing but the restyling comes through, and it lands where it should."""

import numpy as np
import pytest

from sim.body.kinematics import to_local
from sim.body.skeleton import INDEX
from sim.io import bvh
from sim.io.bvh import Motion
from sim.math import rotations as rot
from sim.motion.clip import Clip
from sim.retarget.retarget import retarget
from sim.retarget.retarget_back import retarget_back
from sim.retarget.source_skeleton import mirrored
from tests.support.walker import walking_clip

UP = np.array([0.0, 1.0, 0.0])
Z_UP = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.pi / 2)


def foreign(clip, z_up=False, with_root=False) -> Motion:
    """The clip in inches on a skeleton with longer shins, a finger, another channel order, perhaps Z up, perhaps under
    a root."""
    motion = bvh.from_clip(clip)
    inch = 1 / 2.54
    offsets, positions = motion.offsets * inch, motion.positions * inch
    for side in ("Left", "Right"):
        for name, scale in (("Foot", 1.25), ("ForeArm", 0.8)):
            offsets[INDEX[side + name]] *= scale
            positions[:, INDEX[side + name]] *= scale
    positions[:, 0, 1] += 0.25 * 40 * inch
    frames = len(clip)
    finger = rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.full(frames, 0.2))
    names, parents = [*motion.names, "RightIndex"], [*motion.parents, INDEX["RightHand"]]
    offsets = np.concatenate([offsets, [[-3.0, 0, 0]]])
    positions = np.concatenate([positions, np.tile([-3.0, 0, 0], (frames, 1, 1))], axis=1)
    rotations = np.concatenate([motion.rotations, finger[:, None]], axis=1)
    order = ("Yrotation", "Xrotation", "Zrotation")
    channels = [(*bvh.POSITION_ORDER, *order)] + [order] * (len(names) - 1)
    if z_up:
        positions[:, 0], rotations[:, 0] = rot.rotate(Z_UP, positions[:, 0]), rot.multiply(Z_UP, rotations[:, 0])
    if with_root:
        names, parents = ["Reference", *names], [-1, *(p + 1 for p in parents)]
        offsets = np.concatenate([[[0.0, 0, 0]], offsets])
        positions = np.concatenate([np.zeros((frames, 1, 3)), positions], axis=1)
        rotations = np.concatenate([np.tile(rot.IDENTITY, (frames, 1, 1)), rotations], axis=1)
        channels = [channels[0], *channels]
    return Motion(names, parents, offsets, {}, channels, clip.fps, positions, rotations)


def styled(clip, **turns) -> Clip:
    """The clip with joints turned in world axes about X."""
    rotations = clip.global_rotations()
    for name, angle in turns.items():
        turn = rot.from_axis_angle(np.array([1.0, 0, 0]), np.full(len(clip), angle))
        rotations[:, INDEX[name]] = rot.multiply(turn, rotations[:, INDEX[name]])
    return Clip(clip.hips, to_local(rotations), clip.fps)


@pytest.fixture(params=[(False, False), (True, False), (False, True)], ids=["plain", "z-up", "under-a-root"])
def motion(request):
    return foreign(Clip(walking_clip(120).hips, walking_clip(120).rotations, 40), *request.param)


def on_ours(motion):
    return retarget(motion).resampled()


def test_nothing_restyled_is_the_file_itself(motion, tmp_path):
    content = on_ours(motion)
    back = retarget_back(motion, content, content)
    assert np.allclose(back.positions, motion.positions, atol=1e-9)
    assert np.abs(np.sum(back.rotations * motion.rotations, axis=-1)).min() > 1 - 1e-9
    bvh.write(tmp_path / "back.bvh", back)
    again = bvh.read(tmp_path / "back.bvh")
    assert (again.names, again.parents, again.channels, again.fps) == (
        motion.names,
        motion.parents,
        motion.channels,
        motion.fps,
    )
    assert np.abs(again.global_transforms()[0] - motion.global_transforms()[0]).max() < 1e-3


def test_only_what_was_restyled_moves_and_moves_as_ours(motion):
    content = on_ours(motion)
    back = retarget_back(motion, content, styled(content, RightArm=-0.7, RightForeArm=-0.7, RightHand=-0.7))
    was, now = motion.global_transforms(), back.global_transforms()
    arm = [motion.names.index(name) for name in ("RightArm", "RightForeArm", "RightHand", "RightIndex")]
    others = [joint for joint in range(len(motion.names)) if joint not in arm]
    assert np.abs(now[0][:, others] - was[0][:, others]).max() < 1e-9
    turned = rot.multiply(now[1], rot.inverse(was[1]))
    assert np.allclose(np.linalg.norm(rot.to_rotation_vector(turned[:, arm]), axis=-1), 0.7, atol=1e-6), (
        "the finger rides along"
    )
    assert np.abs(rot.to_rotation_vector(turned[:, others])).max() < 1e-6


def test_feet_move_as_far_as_ours_by_leg_length(motion):
    content = on_ours(motion)
    angles = {"LeftUpLeg": -0.3, "RightUpLeg": -0.3, "LeftLeg": 0.3, "RightLeg": 0.3}
    bent = styled(content, **angles)
    lowered = Clip(bent.hips - [0.0, 0.05, 0.0], bent.rotations)
    wanted = (lowered.positions() - content.positions())[::3]  # 20 a second
    got = (retarget_back(motion, content, lowered).global_transforms()[0] - motion.global_transforms()[0])[::2]
    axes = Z_UP if "Reference" not in motion.names and rot.rotate(motion.rotations[0, 0], UP)[2] > 0.5 else rot.IDENTITY
    scale = (0.43 + 1.25 * 0.40) / (0.43 + 0.40) * 100 / 2.54
    for name in ("Hips", "LeftFoot", "RightFoot"):
        expected = rot.rotate(axes, wanted[:, INDEX[name]]) * scale
        assert np.abs(expected).max() > 1 and np.abs(got[:, motion.names.index(name)] - expected).max() < 0.05


def test_the_files_own_numbers_come_back_where_nothing_was_restyled(motion, tmp_path):
    """Whichever of the angles that tell a rotation the file has, also beyond a quarter turn of the middle one."""
    bvh.write(tmp_path / "first.bvh", motion)
    lines = (tmp_path / "first.bvh").read_text().splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    values = np.array([line.split() for line in lines[start:]], float)
    values[:, -3:] = values[:, -3:] * [1, -1, 1] + [180.0, 180.0, -180.0]  # the same rotation, told otherwise
    rows = [" ".join(f"{value:.6f}" for value in row) for row in values]
    (tmp_path / "file.bvh").write_text("\n".join(lines[:start] + rows) + "\n")
    file = bvh.read(tmp_path / "file.bvh")
    content = on_ours(file)
    for change in ({}, {"RightArm": -0.5}):
        bvh.write(tmp_path / "back.bvh", retarget_back(file, content, styled(content, **change)))
        back = (tmp_path / "back.bvh").read_text().splitlines()[start:]
        same = np.abs(np.array([line.split() for line in back], float) - values).max(axis=0) < 1e-5
        assert same.all() if not change else 0 < (~same).sum() <= 12


def test_a_mirrored_file_comes_back_as_mirrored_as_it_was(motion):
    file = mirrored(motion)
    with pytest.warns(UserWarning, match="mirrored"):
        content = on_ours(file)
    back = retarget_back(file, content, content)
    assert np.abs(back.global_transforms()[0] - file.global_transforms()[0]).max() < 1e-6
