"""Leaps are found by how high the feet and the hips are."""

import pytest

from controller.training.leaps import find_flights
from tests.support.walker import leaping_clip, walking_clip

START = 60  # the frame in which the leap leaves the floor


@pytest.mark.parametrize(
    "clip", [leaping_clip(START, 1.2), leaping_clip(START, 0.15), leaping_clip(START, 0.5, 4.0), walking_clip(120)]
)
def test_what_hangs_hops_floats_or_walks_is_no_leap(clip):
    assert find_flights(clip.positions()) == []
