"""A character in our poses: limbs point where ours do, planted feet stand on their own soles, nothing jumps."""

import numpy as np

from sim.body.skeleton import INDEX
from sim.character.character import load_character
from sim.character.figures import degrees_off, measure
from sim.character.fit import CharacterFit
from sim.ground.catalogue import load_ground
from sim.math import rotations as rot
from sim.math.vectors import UP
from tests.sim.character.conftest import KINDS
from tests.support.skinned import write


def fitted(tmp_path, build, poses, ground=None):
    character = load_character(write(tmp_path / "hero.glb", build))
    fit = CharacterFit(character)
    return character, [fit.step(pose, ground) for pose in poses]


def corners(character, one) -> np.ndarray:
    """(n, 3) of its mesh in a pose, by the specification's formula."""
    mesh = character.mesh
    arms = mesh.positions[:, None] - character.rest[mesh.joints]
    turned = rot.rotate(one.rotations[mesh.joints], arms) + one.positions[mesh.joints]
    return np.sum(mesh.weights[..., None] * turned, axis=1)


def test_limbs_point_where_ours_do(tmp_path, build, walk):
    character, each = fitted(tmp_path, build, walk)
    off = degrees_off(character, walk, each)
    for arm in ("arms", "forearms"):
        assert off[arm].max() < 1e-4
    for leg in ("thighs", "shins"):
        assert off[leg].mean() < 2.0
        assert np.percentile(off[leg], 95) < 2.0 or build.longer


def test_planted_feet_stand_on_the_floor_and_do_not_slide(tmp_path, build, walk):
    character, each = fitted(tmp_path, build, walk)
    contacts = np.array([pose.contacts for pose in walk])
    for side, ankle, toe in (("Left", 0, 1), ("Right", 2, 3)):
        own = [INDEX[side + "Foot"], INDEX[side + "Toe"]]
        foot = np.isin(character.owners[character.mesh.joints[:, 0], 0], own)
        lowest = np.array([corners(character, one)[foot, 1].min() for one in each])
        planted = contacts[:, [ankle, toe]].max(axis=-1) > 0.5
        settled = planted & np.roll(planted, 4) & np.roll(planted, -4)
        assert settled.any() and np.abs(lowest[settled]).max() < 0.01
        assert lowest.min() > -0.01
    figures = measure(character, walk)
    assert figures["its_skate_cm_s"] < figures["our_skate_cm_s"] + 0.1, "ours creeps a little, and it no more"


def test_nothing_jumps(tmp_path, build, walk):
    character, each = fitted(tmp_path, build, walk)
    ours = np.array([pose.positions for pose in walk])
    theirs = np.array([one.positions for one in each])[:, list(character.index.values())]
    fastest = np.linalg.norm(np.diff(ours, axis=0), axis=-1).max()
    assert np.linalg.norm(np.diff(theirs, axis=0), axis=-1).max() < 1.5 * fastest + 0.01
    feet = [INDEX["LeftFoot"], INDEX["RightFoot"]], [character.index["LeftFoot"], character.index["RightFoot"]]
    ours, theirs = (
        np.array([one.rotations[joints] for one in poses]) for poses, joints in zip((walk, each), feet, strict=True)
    )
    turns = [np.abs(rot.to_rotation_vector(rot.multiply(q[1:], rot.inverse(q[:-1])))).max() for q in (ours, theirs)]
    assert turns[1] < 2 * turns[0], "feet that give way do so over some frames"


def test_bones_keep_their_lengths_and_other_joints_their_place(tmp_path, walk):
    character, each = fitted(tmp_path, KINDS["other proportions"], walk)
    parents = character.rig.parents
    bones = [np.flatnonzero(character.under_hips[joint]).tolist() for joint in range(len(parents))]
    joints = [joint for joint, chain in enumerate(bones) if chain]
    rest = np.linalg.norm(character.rest[joints] - character.rest[parents[joints]], axis=-1)
    for one in each[::20]:
        lengths = np.linalg.norm(one.positions[joints] - one.positions[parents[joints]], axis=-1)
        np.testing.assert_allclose(lengths, rest, atol=1e-9)
    hair, head = character.joint_names.index("hair"), character.index["Head"]
    np.testing.assert_array_equal(each[-1].rotations[hair], each[-1].rotations[head])


def test_our_own_skeleton_stands_as_we_do(tmp_path, walk):
    character, each = fitted(tmp_path, KINDS["our names"], walk[:20])
    theirs = each[-1].positions[[character.index[name] for name in INDEX]]
    assert np.abs(theirs - walk[19].positions).max() < 0.01


def test_on_uneven_ground_feet_are_as_high_as_ours(tmp_path, walk):
    character, each = fitted(tmp_path, KINDS["our names"], walk, load_ground("hills"))
    ours = np.array([pose.positions[INDEX["LeftFoot"]] for pose in walk])
    theirs = np.array([one.positions[character.index["LeftFoot"]] for one in each])
    rise = (theirs - ours) @ UP
    assert rise.min() > -0.02, "it never goes into the ground that ours stands on"


def test_a_character_that_is_put_elsewhere_starts_anew(tmp_path, walk):
    character, each = fitted(tmp_path, KINDS["VRM 1"], walk)
    fit = CharacterFit(character)
    for pose in walk:
        fit.step(pose)
    again = fit.step(walk[0].__class__(walk[0].root_position + 50.0, *list(vars(walk[0]).values())[1:6]))
    assert np.isfinite(again.positions).all()


def test_bones_are_the_transforms_of_the_mesh(tmp_path, walk):
    character, each = fitted(tmp_path, KINDS["other proportions"], walk)
    mesh = character.mesh
    transforms = each[9].bones(character).reshape(-1, 4, 3)
    homogeneous = np.column_stack([mesh.positions, np.ones(len(mesh.positions))])
    moved = np.einsum("nt,nj,ntjk->nk", mesh.weights, homogeneous, transforms[mesh.joints])
    np.testing.assert_allclose(moved, corners(character, each[9]), atol=1e-5)
