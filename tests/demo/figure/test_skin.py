"""The figure's skin as it is read from its file: closed, of a person's size, on its joints, and made by this code."""

import numpy as np
import pytest
from scipy import sparse

from demo.figure import body, skin
from demo.figure.forms import BIND
from sim.body.skeleton import INDEX, JOINT_COUNT
from sim.io import tensor_file
from sim.math import rotations as rot
from tests.support.walker import walking_clip

ACROSS_FINGERS, BESIDE_THUMB = 0.125, 0.056  # metres from the wrist along a hand, and forwards across it
LEVELS = (skin.FINE, skin.MEDIUM, skin.COARSE)


@pytest.fixture(params=LEVELS)
def level(request):
    return skin.load_skin(request.param)


def test_the_file_was_made_by_this_code():
    header = tensor_file.read_header(skin.FILE)
    assert header["made_by"] == skin.source_fingerprint(), "make it again: python -m demo.tools.figure_mesh"
    assert header["command"] == "python -m demo.tools.figure_mesh"


def test_the_fingerprint_is_of_the_shape(monkeypatch):
    before = skin.source_fingerprint()
    monkeypatch.setattr(skin, "MADE_BY", skin.MADE_BY[:-1])
    assert skin.source_fingerprint() != before


def test_it_is_closed_and_turned_outwards(level):
    a, b, c = level.triangles.T
    edges = np.concatenate([np.stack(pair, -1) for pair in ((a, b), (b, c), (c, a))])
    assert sorted(edges.tolist()) == sorted(edges[:, ::-1].tolist()), "each edge is used as often one way as the other"
    p, q, r = (level.positions[corner] for corner in (a, b, c))
    volume = np.sum(p * np.cross(q, r)) / 6
    assert 0.05 < volume < 0.10, "cubic metres: a person"


def test_it_stands_on_the_floor_and_is_as_tall_as_the_skeleton(level):
    assert -0.02 < level.positions[:, 1].min() < 0.01
    assert 1.70 < level.positions[:, 1].max() < 1.80


def test_its_halves_are_mirror_images(level):
    left, right = (level.positions[level.positions[:, 0] * side > 1e-6] * [side, 1, 1] for side in (1, -1))
    sorted_left, sorted_right = (half[np.lexsort(half.T.round(6))] for half in (left, right))
    np.testing.assert_allclose(sorted_left, sorted_right, atol=1e-6)


def test_its_triangles_lie_along_the_surface():
    """Folded across an edge of the body they would stand out of its outline as the teeth of a saw."""
    fine = skin.load_skin(skin.FINE)
    p, q, r = (fine.positions[corner] for corner in fine.triangles.T)
    flat, smooth = rot.normalize(np.cross(q - p, r - p)), rot.normalize(fine.normals[fine.triangles].mean(axis=1))
    apart = np.degrees(np.arccos(np.clip(np.vecdot(flat, smooth), -1, 1)))
    assert np.percentile(apart, 95) < 15


def test_hands_have_fingers():
    """Cut across, a hand is four separate rings, one a finger."""
    fine, hand = skin.load_skin(skin.FINE), INDEX["LeftHand"]
    own = (fine.joints[np.arange(len(fine.joints)), fine.weights.argmax(1)] == hand)[fine.triangles].all(axis=1)
    local = rot.rotate(rot.inverse(BIND.rotations[hand]), fine.positions - BIND.positions[hand])
    x, _, z = local[fine.triangles[own]].transpose(2, 0, 1)
    cut = (x.min(axis=1) < ACROSS_FINGERS) & (x.max(axis=1) > ACROSS_FINGERS) & (z.max(axis=1) < BESIDE_THUMB)
    triangles = fine.triangles[own][cut]
    corners, places = np.unique(triangles, return_inverse=True)
    places = places.reshape(-1, 3)
    graph = sparse.coo_matrix(
        (np.ones(places.size), (places.ravel(), np.roll(places, 1, axis=1).ravel())), (len(corners), len(corners))
    )
    assert sparse.csgraph.connected_components(graph)[0] == 4


def test_corners_hang_on_nearby_joints(level):
    np.testing.assert_allclose(level.weights.sum(-1), 1, atol=1e-6)
    main = level.joints[np.arange(len(level.joints)), level.weights.argmax(-1)]
    assert set(level.joints[level.weights > 0.1]) == set(range(JOINT_COUNT)), "every joint moves something"
    assert np.linalg.norm(level.positions - BIND.positions[main], axis=-1).max() < 0.45


def test_it_follows_its_joints(level):
    corners = level.posed(body.bones(BIND))
    np.testing.assert_allclose(corners, [level.positions, level.normals], atol=1e-5)


def test_bones_leave_the_bind_pose_alone_and_carry_the_skin_with_a_pose():
    np.testing.assert_allclose(body.bones(BIND), np.tile(np.eye(4, 3), (JOINT_COUNT, 1)), atol=1e-6)
    clip = walking_clip(30)
    pose = BIND.with_body(clip.hips[20], clip.global_rotations()[20])
    bones = body.bones(pose, shift=(1.0, 0, 0))
    bind = np.concatenate([BIND.positions, np.ones((JOINT_COUNT, 1))], axis=-1)
    posed = np.einsum("jk,jkx->jx", bind, bones.reshape(JOINT_COUNT, 4, 3))
    np.testing.assert_allclose(posed, pose.positions + [1.0, 0, 0], atol=1e-5)


def test_edges_have_two_sides_but_at_a_border_and_not_at_a_seam():
    """Two triangles side by side: corners that a texture's seam has doubled are one."""
    places = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    triangles = np.array([[0, 1, 2], [3, 4, 5]])
    one = np.ones((6, 1))
    corners, sides = skin.Skin(places, places, one.astype(int), one, triangles, np.zeros((6, 6))).edges
    assert len(corners) == 5 and sorted(sides[:, 1].tolist()) == [-1, -1, -1, -1, 1]


def test_a_damaged_file_is_said_in_a_sentence(tmp_path, monkeypatch):
    header, arrays = tensor_file.read(skin.FILE)
    del arrays["fine.weights"]
    tensor_file.write(tmp_path / "mesh.safetensors", arrays, header)
    monkeypatch.setattr(skin, "FILE", tmp_path / "mesh.safetensors")
    with pytest.raises(ValueError, match="reinstall Patchwalk"):
        skin.load_skin.__wrapped__(skin.FINE)
