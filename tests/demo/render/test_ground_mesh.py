"""The triangles of uneven ground: they cover it once, lie on it, and hold still in the world."""

import numpy as np
import pytest

from demo.render.camera import Camera
from demo.render.ground_mesh import LEVEL, STRAIGHT, TOLERANCE, GroundMesh, tangent_plane
from sim.ground.catalogue import load_ground
from sim.ground.ground import Ground

PLACES = [(0.0, 0.0), (0.37, 2.48), (-7.9, 13.2)]


def mesh_at(name: str, place=PLACES[1]) -> GroundMesh:
    mesh = GroundMesh(load_ground(name))
    mesh.move(np.array(place))
    return mesh


def sloped(rise_x: float, rise_z: float) -> Ground:
    place = (np.arange(400) - 200) * 0.1
    return Ground((rise_x * place + rise_z * place[:, None]).astype(np.float32), 0.1, tiled=False)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", ["hills", "stairs", "rough"])
def test_quads_cover_the_ground_once(name, place):
    quads = mesh_at(name, place).quads
    low, high = quads[:, 0, :3:2], quads[:, 2, :3:2]
    whole = np.prod(high.max(axis=0) - low.min(axis=0))
    assert np.prod(high - low, axis=-1).sum() == pytest.approx(whole, rel=1e-5) and whole > 38**2
    points = np.random.default_rng(1).uniform(low.min(axis=0), high.max(axis=0), (500, 2))
    assert (np.all((low[:, None] <= points) & (points < high[:, None]), axis=-1).sum(axis=0) == 1).all()


@pytest.mark.parametrize("name", ["hills", "stairs", "rough"])
def test_near_the_character_triangles_lie_on_the_ground(name):
    quads, ground = mesh_at(name).quads, load_ground(name)
    near = quads[np.linalg.norm(quads[:, :, :3:2] - PLACES[1], axis=-1).max(axis=-1) < 1.1]
    assert len(near) > 30
    np.testing.assert_allclose(near[..., 1], ground.height_at(near[..., :3:2]), atol=1e-5)
    middles = near.mean(axis=1)
    assert np.abs(middles[:, 1] - ground.height_at(middles[:, :3:2])).max() < 2 * TOLERANCE


def test_grids_meet_without_a_gap():
    """Every corner on the border of a grid lies on the edge of the coarser quad beside it."""
    quads = mesh_at("rough").quads.astype(float)
    size = quads[:, 2, 0] - quads[:, 0, 0]
    edges = quads[np.abs(size - 0.2) < 0.01]  # of the second grid
    fine = quads[np.abs(size - 0.1) < 0.01].reshape(-1, 4)
    checked = 0
    for a, b in zip(edges.reshape(-1, 4), np.roll(edges, -1, axis=1).reshape(-1, 4)):
        along = np.argmax(np.abs(b - a)[[0, 2]]) * 2
        across = 2 - along
        on = (np.abs(fine[:, across] - a[across]) < 1e-4) & (np.abs(fine[:, along] - (a + b)[along] / 2) < 1e-4)
        checked += on.sum()
        np.testing.assert_allclose(fine[on, 1], (a + b)[1] / 2, atol=STRAIGHT)
    assert checked > 50


def test_moved_a_little_it_stays_and_farther_its_corners_are_at_the_same_points():
    mesh = mesh_at("rough")
    assert not mesh.move(np.array(PLACES[1]) - 0.05)
    before = {tuple(corner[:3:2].round(3)): corner[1] for corner in mesh.quads.reshape(-1, 4)}
    assert mesh.move(np.array(PLACES[1]) + [0.0, 1.0])
    again = [(corner[1], before.get(tuple(corner[:3:2].round(3)))) for corner in mesh.quads.reshape(-1, 4)]
    same = [now == then for now, then in again if then is not None]
    assert len(same) > 1000 and np.mean(same) > 0.9, "all but those that changed their grid"


def test_only_what_is_in_the_picture_is_drawn():
    mesh = mesh_at("hills", (0.0, 0.0))
    matrix = Camera().world_to_clip(16 / 9)
    seen = mesh.seen(matrix)
    assert 0.1 < len(seen) / len(mesh.quads) < 0.5
    middles = np.append(mesh.quads.mean(axis=1)[:, :3], np.ones((len(mesh.quads), 1)), axis=1) @ matrix.T
    inside = (np.abs(middles[:, :2]) < middles[:, 3:]).all(axis=-1)
    assert set(np.flatnonzero(inside)) <= set(seen)


def test_quads_within_a_rectangle():
    mesh = mesh_at("stairs")
    (numbers,) = mesh.within(np.array([[0.1, 2.0]]), np.array([[0.3, 2.2]]))
    quads = mesh.quads[numbers]
    assert (quads[:, 0, :3:2] < [0.3, 2.2]).all() and (quads[:, 2, :3:2] > [0.1, 2.0]).all()
    assert quads[:, :, 0].min() <= 0.1 and quads[:, :, 0].max() >= 0.3 and len(numbers) < 40


def test_slopes_that_face_the_light_are_lighter_and_steps_have_sharp_edges():
    toward, away = (sloped(0.0, rise) for rise in (-0.4, 0.4))  # the light comes from +z
    lights = []
    for ground in (toward, sloped(0.0, 0.0), away):
        mesh = GroundMesh(ground)
        mesh.move(np.zeros(2))
        lights.append(np.median(mesh.quads[..., 3]))
    assert lights[1] == pytest.approx(1) and lights[0] > 1 and lights[2] < 0.9
    stairs = mesh_at("stairs").quads
    near = np.linalg.norm(stairs[..., :3:2] - PLACES[1], axis=-1).max(axis=-1) < 1.6
    treads = stairs[near & (np.ptp(stairs[..., 1], axis=1) < 1e-5)]
    assert len(treads) > 30 and np.abs(treads[..., 3] - 1).max() < 1e-4, "level, up to their edges"


def test_the_plane_under_a_place_touches_the_ground():
    np.testing.assert_array_equal(tangent_plane(None, np.array([3.0, 4.0])), LEVEL)
    height, rise_x, rise_z = tangent_plane(sloped(0.2, -0.3), np.array([3.0, 4.0]))
    assert (rise_x, rise_z) == (pytest.approx(0.2, abs=1e-4), pytest.approx(-0.3, abs=1e-4))
    assert height == pytest.approx(0.0, abs=1e-3), "of the plane at the origin"
