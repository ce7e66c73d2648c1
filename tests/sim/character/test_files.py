"""BVH and poses files in a character's own skeleton: its names, its proportions, and the same places again."""

import numpy as np
import pytest

from sim.character.character import load_character
from sim.character.files import CharacterRows, to_bvh
from sim.character.motion import fit_motion
from sim.command import Command
from sim.io import bvh, poses_npz
from sim.math import rotations as rot
from sim.session import Frame
from tests.sim.character.conftest import KINDS
from tests.support.skinned import write


@pytest.fixture
def character(tmp_path, build):
    return load_character(write(tmp_path / "hero.glb", build))


def test_a_bvh_has_the_character_s_joints_where_they_are(tmp_path, character, walk):
    motion = fit_motion(character, walk[:60], fps=30)
    bvh.write(tmp_path / "a.bvh", to_bvh(motion))
    again = bvh.read(tmp_path / "a.bvh")
    joints = [character.joint_names.index(name) for name in again.names]
    assert sorted(joints) == np.flatnonzero(character.hangs).tolist() and again.fps == 30
    places = again.global_transforms()[0] / bvh.CENTIMETRES
    np.testing.assert_allclose(places, motion.positions[:, joints], atol=1e-4)


def test_the_poses_file_s_own_numbers_make_its_positions(tmp_path, character, walk):
    frames = [Frame(Command(), pose, pose) for pose in walk[:30]]
    rows = CharacterRows(character)
    with poses_npz.writer(tmp_path / "a.npz", rows, rows.constants) as add:
        for frame in frames:
            add(frame)
    poses = np.load(tmp_path / "a.npz")
    assert poses["joint_names"].tolist() == list(character.joint_names)
    np.testing.assert_array_equal(poses["positions"], poses["neutral_positions"])
    np.testing.assert_allclose(poses["root_position"], [pose.root_position * character.scale for pose in walk[:30]])
    world, places = poses["rotations"].copy(), poses["positions"].copy()
    for joint, parent in enumerate(poses["parents"]):
        if parent >= 0:
            world[:, joint] = rot.multiply(world[:, parent], poses["rotations"][:, joint])
            if joint != character.index["Hips"]:
                places[:, joint] = places[:, parent] + rot.rotate(world[:, parent], poses["bone_offsets"][joint])
    np.testing.assert_allclose(places, poses["positions"], atol=1e-9)


def test_only_the_usual_frame_rates_are_written(tmp_path, walk):
    character = load_character(write(tmp_path / "hero.glb", KINDS["our names"]))
    assert len(fit_motion(character, walk[:61], fps=30)) == 31
    with pytest.raises(ValueError, match="24 frames a second are not written: choose 30 or 60"):
        fit_motion(character, walk, fps=24)
    with pytest.raises(ValueError, match="no frame"):
        fit_motion(character, [])
