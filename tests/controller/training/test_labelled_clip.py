"""Leaps and crouches are found in clips that hold them, by how high the feet and the hips are."""

from dataclasses import replace

import numpy as np

from controller.training.labelled_clip import label
from controller.training.leaps import find_flights
from sim.math.vectors import UP
from sim.motion.clip import FPS
from tests.support.walker import leaping_clip, planted_clip, walking_clip

SECONDS, START = 0.5, 60  # of the flight, and the frame in which it begins


def test_a_leap_is_found_and_its_lift_is_the_bodys():
    source = label(leaping_clip(START, SECONDS), jumps=True)
    ((start, stop),) = find_flights(leaping_clip(START, SECONDS).positions())
    assert abs(start - START) <= 2 and abs(stop - START - SECONDS * FPS) <= 2
    np.testing.assert_allclose(source.clip.hips[:, 1] - source.lift, source.clip.hips[0, 1], atol=0.06)
    assert source.jump[START] == 1 and source.jump[0] == source.jump[-1] == 0
    np.testing.assert_allclose(source.root().positions[:, 1], source.lift)


def test_labels_are_asked_for():
    assert not label(leaping_clip(START, SECONDS)).lift.any()
    low = replace(planted_clip(120), hips=planted_clip(120).hips - 0.2 * UP)
    assert label(low, crouches=True).crouch.min() == 1 and not label(low).crouch.any()
    assert not label(planted_clip(120), crouches=True).crouch.any()


def test_the_mirrored_clip_has_its_contacts_and_its_phase_on_the_other_side():
    source = label(walking_clip(240).grounded())
    other = label(walking_clip(240).grounded().mirrored())
    mirrored = source.mirrored()
    np.testing.assert_array_equal(mirrored.contacts, other.contacts)
    apart = np.angle(np.exp(1j * (mirrored.phase - other.phase)))
    assert np.abs(apart[30:-30]).max() < 0.2
