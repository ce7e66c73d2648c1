"""Leaps are found by how high the feet and the hips are; those from the spot gather quicker than captured."""

from dataclasses import replace

import numpy as np
import pytest

from controller.training.leaps import GATHERING, PUSH, QUICKER, find_flights, quicken_gathering
from sim.math.vectors import FORWARD, UP
from sim.motion.clip import FPS, Clip
from tests.support.walker import leaping_clip, planted_clip, walking_clip

START = 60  # the frame in which the leap leaves the floor


@pytest.mark.parametrize(
    "clip", [leaping_clip(START, 1.2), leaping_clip(START, 0.15), leaping_clip(START, 0.5, 4.0), walking_clip(120)]
)
def test_what_hangs_hops_floats_or_walks_is_no_leap(clip):
    assert find_flights(clip.positions()) == []


def squatting(speed: float = 0.0) -> Clip:
    """Hips that sink for GATHERING seconds, push for PUSH and fly, above a root that goes on in metres a second."""
    time = (np.arange(240) - 120) / FPS
    squat = np.interp(time, (-PUSH - GATHERING, -PUSH, 0.0), (0.0, -0.2, 0.0))
    clip = planted_clip(240)
    return replace(clip, hips=clip.hips + squat[:, None] * UP + (speed * time)[:, None] * FORWARD)


def test_a_leap_from_the_spot_gathers_quicker_and_pushes_as_captured():
    clip = squatting()
    quick, take_off = quicken_gathering(clip, 120)
    assert take_off == pytest.approx(120 - (GATHERING - GATHERING / QUICKER) * FPS, abs=2)
    assert len(clip) - len(quick) == 120 - take_off
    np.testing.assert_allclose(quick.hips[take_off:], clip.hips[120:], atol=1e-9)
    push = round((PUSH - 0.1) * FPS)  # the quicker time sets in smoothly
    np.testing.assert_allclose(quick.hips[take_off - push : take_off], clip.hips[120 - push : 120], atol=2e-3)
    fall = np.diff(quick.hips[:take_off, 1]).min() / np.diff(clip.hips[:120, 1]).min()
    assert fall == pytest.approx(QUICKER, rel=0.1)
    assert np.linalg.norm(np.diff(quick.hips, axis=0), axis=-1).max() < 0.05


def test_a_leap_that_is_run_up_to_stays_as_it_was_captured():
    clip = squatting(speed=2.0)
    assert quicken_gathering(clip, 120) == (clip, 120)


def test_a_leap_at_the_very_start_of_a_clip_passes():
    quick, take_off = quicken_gathering(squatting()[115:], 5)
    assert 0 < take_off <= 5 and len(quick) == 120 + take_off
