"""A character's skin and its one picture: every corner finds its own colour, borders are seen from both sides."""

from dataclasses import replace

import numpy as np
import pytest

from demo.figure.character_model import DrawnCharacter, character_model
from sim.body.pose import Pose
from sim.character.character import Character, load_character
from sim.character.mesh import Material
from sim.math import rotations as rot
from tests.support.skinned import write


@pytest.fixture
def character(tmp_path) -> Character:
    return load_character(write(tmp_path / "hero.glb"))


def sampled(model) -> np.ndarray:
    """(n, 3) the display colours that the shader finds at the corners: nearest pixel times the corner's own."""
    height, width = model.picture.shape[:2]
    x, y = (model.fine.materials[:, 4:] * [width, height]).T
    pixels = model.picture[np.clip(y, 0, height - 1).astype(int), np.clip(x, 0, width - 1).astype(int), :3]
    return model.fine.materials[:, :3] * pixels / 255


def test_corners_find_their_own_colours_in_the_one_picture(character):
    model = character_model(character)
    colours = sampled(model)
    stop = character.mesh.ranges[0][1]
    textured, plain = (colours[part.ravel()] for part in np.split(model.fine.triangles, [stop]))
    red, blue = np.array([200, 30, 30]) / 255, np.array([30, 30, 200]) / 255
    to_red, to_blue = np.abs(textured - red).max(axis=-1), np.abs(textured - blue).max(axis=-1)
    assert (np.minimum(to_red, to_blue) < 0.01).all() and (to_red < 0.01).any() and (to_blue < 0.01).any()
    np.testing.assert_allclose(plain, np.tile([0.9, 0.5, 0.2], (len(plain), 1)), atol=1e-6)


def test_many_pictures_lie_side_by_side(character):
    rng = np.random.default_rng(0)
    mesh, count = character.mesh, 5
    pictures = [np.full((4 + k, 6, 4), 255, np.uint8) for k in range(count)]
    for picture in pictures:
        picture[..., :3] = rng.integers(0, 255, 3)
    ends = np.linspace(0, len(mesh.triangles), count + 1).astype(int)
    materials = tuple(Material(str(k), picture=picture) for k, picture in enumerate(pictures))
    split = replace(mesh, materials=materials, ranges=tuple(zip(ends[:-1].tolist(), ends[1:].tolist())))
    model = character_model(replace(character, mesh=split))
    colours = sampled(model)
    for triangles, picture in zip(np.split(model.fine.triangles, ends[1:-1]), pictures):
        np.testing.assert_allclose(colours[triangles.ravel()], picture[0, 0, :3] / 255 + 0 * colours[triangles.ravel()])


def test_a_texture_that_is_repeated_is_moved_into_the_picture(character):
    mesh = character.mesh
    moved = replace(mesh, uvs=mesh.uvs + [3.0, -2.0])
    plain, repeated = (character_model(replace(character, mesh=each)) for each in (mesh, moved))
    np.testing.assert_allclose(
        repeated.fine.materials[repeated.fine.triangles], plain.fine.materials[plain.fine.triangles], atol=1e-6
    )


def test_what_has_borders_is_seen_from_behind_and_what_is_cut_out_is_not_drawn(character):
    mesh = character.mesh
    holes = mesh.materials[0].picture.copy()
    holes[:4, :, 3] = 0
    cloth = replace(mesh.materials[0], picture=holes, cut_off=0.5, double_sided=True)
    one = replace(mesh, triangles=mesh.triangles[::3], materials=(cloth,), ranges=((0, len(mesh.triangles[::3])),))
    model = character_model(replace(character, mesh=one))
    assert len(model.fine.triangles) == 2 * len(one.triangles)
    assert (model.picture[..., 3] == 0).mean() == 0.5
    whole = replace(mesh, materials=(cloth, mesh.materials[1]))
    assert len(character_model(replace(character, mesh=whole)).fine.triangles) == len(mesh.triangles)


def test_a_drawn_character_follows_poses(character):
    drawn = DrawnCharacter(character)
    still = Pose(np.zeros(3), 0.0, np.array([0.0, 0.97, 0.0]), np.tile(rot.IDENTITY, (21, 1)), np.ones(4), 0.0)
    drawn.follow(still, None)
    figure = drawn.figure(np.zeros(3))
    corners = drawn.model.fine.posed(figure.bones)[0]
    assert abs(corners[:, 1].min()) < 0.005 and figure.model is drawn.model
    assert corners[:, 1].max() == pytest.approx(drawn.points[:, 1].max(), abs=0.01)
