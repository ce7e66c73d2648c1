"""A walk that is laid on uneven ground: planted feet lie on it, level ground changes nothing, hips follow."""

import numpy as np
import pytest

from controller.training.labelled_clip import label
from controller.training.terrain_fit import CLEARANCE, Placed, fit_to_ground
from sim.body.skeleton import CONTACT_JOINTS
from sim.feet.contact_correction import plant_feet
from sim.ground.catalogue import load_ground
from sim.ground.ground import Ground, sole_heights
from sim.motion.clip import root_frame
from sim.motion.thresholds import PLANTED
from tests.support.walker import walking_clip

LEVEL = Ground(np.zeros((8, 8), np.float32), 0.5)


@pytest.fixture(scope="module")
def source():
    return label(plant_feet(walking_clip(300).grounded()))


def over(ground: Placed, places: np.ndarray) -> np.ndarray:
    return places[..., 1] - ground.height_at(places[..., ::2])


def test_level_ground_leaves_the_walk_as_it_is(source):
    fitted = fit_to_ground(source, Placed(LEVEL, 1.0, np.ones(2)))
    feet, flat = (clip.positions()[:, CONTACT_JOINTS] for clip in (fitted.clip, source.clip))
    np.testing.assert_allclose(fitted.clip.hips, source.clip.hips, atol=1e-6)
    np.testing.assert_allclose(feet, flat, atol=CLEARANCE)
    planted = source.contacts > PLANTED
    np.testing.assert_allclose(feet[planted], flat[planted], atol=2e-3)


@pytest.mark.parametrize("name", ["hills", "stairs", "rough"])
def test_planted_feet_lie_on_the_ground_and_hips_go_with_it(source, name):
    ground = Placed(load_ground(name), 0.4, np.array([2.0, 3.0]))
    fitted = fit_to_ground(source, ground)
    flat, feet = (clip.positions()[:, CONTACT_JOINTS].reshape(-1, 2, 2, 3) for clip in (source.clip, fitted.clip))
    soles = sole_heights(ground.height_at(feet[..., ::2]))
    planted = source.contacts.reshape(-1, 2, 2).max(axis=-1) > PLANTED
    off = np.abs((feet[..., 1] - soles).min(axis=-1) - flat[..., 1].min(axis=-1))[planted]
    assert np.median(off) < 0.005 and np.percentile(off, 95) < 0.05
    root = root_frame(fitted.clip.positions()).positions
    rise = fitted.clip.hips[:, 1] - ground.smooth_height_at(root[:, ::2]) - source.clip.hips[:, 1]
    assert rise.max() < 0.05 and rise.min() > -0.25, "hips may sink for a leg, and never float"
    assert over(ground, feet).min() > -0.12


def test_heights_are_of_the_ground_that_it_is_laid_on(source):
    ground = Placed(load_ground("hills"), 0.4, np.array([2.0, 3.0]))
    fitted = fit_to_ground(source, ground)
    places = np.array([[0.0, 0.0], [1.0, 2.0]])
    np.testing.assert_array_equal(fitted.height_at(places), ground.height_at(places))
    assert np.ptp(fitted.root().positions[:, 1]) > 0.05
