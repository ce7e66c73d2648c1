"""The surface that the skin lies on, cut coarsely, and made fewer triangles."""

import numpy as np
import pytest

from demo.figure import forms, simplify, skin, surface
from demo.figure.surface_nets import surface_nets
from sim.body.capsules import CAPSULE_RADII, capsule_ends
from sim.body.skeleton import INDEX, MIRROR
from sim.math import rotations as rot

CELL = 0.1


@pytest.fixture(scope="module")
def ball() -> tuple[np.ndarray, np.ndarray]:
    """Corners and triangles of the half of a ball of radius 1 whose border lies on x = 0."""
    axes = [np.arange(0.0, 1.3, CELL), np.arange(-1.25, 1.3, CELL), np.arange(-1.25, 1.3, CELL)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    corners, quads = surface_nets(rot.length(grid)[..., 0] - 1)
    positions = np.array([0.0, -1.25, -1.25]) + corners * CELL
    positions[positions[:, 0] < CELL, 0] = 0.0
    return rot.normalize(positions), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def test_surface_nets_find_the_surface(ball):
    positions, triangles = ball
    p, q, r = positions[triangles].swapaxes(0, 1)
    assert np.sum(p * np.cross(q, r)) / 6 == pytest.approx(2 / 3 * np.pi, rel=0.02), "half a ball, turned outwards"


def test_collapsing_leaves_the_same_ball_of_fewer_triangles(ball):
    positions, triangles = ball
    mesh = simplify.Mesh(positions, positions, np.full(len(positions), 0.3), triangles)
    border = mesh.on_plane.copy()
    mesh.collapse()
    mesh.flip_edges()
    mesh.even_out()
    used, kept = mesh.compact()
    assert len(kept) < len(triangles) / 4
    p, q, r = mesh.positions[used][kept].swapaxes(0, 1)
    assert np.sum(p * np.cross(q, r)) / 6 == pytest.approx(2 / 3 * np.pi, rel=0.04)
    assert rot.length(mesh.positions[used]).max() < 1.02 and border.any()
    np.testing.assert_array_equal(mesh.positions[used][mesh.on_plane[used], 0], 0.0)
    edges = np.sort(np.concatenate([kept[:, [0, 1]], kept[:, [1, 2]], kept[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert set(uses.tolist()) == {1, 2} and (uses == 1).sum() == mesh.on_plane[used].sum(), "its border is one circle"


def test_the_shipped_skin_lies_on_the_surface():
    fine = skin.load_skin(skin.FINE)
    off = np.abs(surface.distance(fine.positions[::17].astype(float)))
    assert off.max() < 5e-4


def test_directions_and_openness_tell_a_fold_from_a_crown():
    head, hip = (forms.BIND.positions[INDEX[name]] for name in ("Head", "LeftUpLeg"))
    crown = surface.project(np.array([head + [0.0, 0.2, 0.0]]))
    fold = surface.project(np.array([[0.012, hip[1] - 0.11, 0.0]]))
    (up,) = surface.direction(crown)
    assert up[1] > 0.98
    open_at = [surface.openness(place, surface.direction(place))[0] for place in (crown, fold)]
    assert open_at[0] > 0.9 and open_at[1] < 0.7


def test_forms_are_mirrored_and_joints_have_them():
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 3)) + [0, 1.0, 0]
    away, mirrored = surface.joint_distance(points), surface.joint_distance(points * [-1, 1, 1])
    assert np.isfinite(away).all(), "every joint has a form"
    np.testing.assert_allclose(mirrored, away[:, MIRROR], atol=1e-9)


def test_the_bodys_capsules_are_as_thick_as_the_skin():
    """They are what hands are kept out of, in sim, which knows of no skin."""
    ends = capsule_ends(forms.BIND)
    around = rot.normalize(np.random.default_rng(0).normal(size=(40, 3)))
    share = np.linspace(0, 1, 40)[:, None]
    for (start, stop), radius in zip(ends, CAPSULE_RADII):
        assert surface.distance(start + share * (stop - start) + radius * around).max() < 0.03, "none stands far out"
    places = skin.load_skin(skin.MEDIUM).positions.astype(float)
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    at = np.clip(np.vecdot(places[:, None] - start, along) / np.vecdot(along, along), 0, 1)
    away = rot.length(places[:, None] - start - at[..., None] * along)[..., 0] - CAPSULE_RADII
    assert np.median(away.min(axis=1)) < 0.01 and np.percentile(away.min(axis=1), 95) < 0.04, "and they fill the skin"
