"""The parts of one character on their way to what is asked."""

import pytest

from sim.style_spec import StyleSpec
from stylizer.runtime.style_mixer import StyleMixer

SPINE = 2


@pytest.mark.parametrize("strength", [0.3, 1.0, 1.5])
def test_a_strength_glides_and_arrives_exactly(strength):
    mixer, seen = StyleMixer(4), []
    for _ in range(180):
        mixer.step(StyleSpec({"spine": ("other", strength)}))
        seen.append(mixer.strengths[SPINE])
    assert seen == sorted(seen) and 0 < seen[0] < 0.1 * strength and seen[-1] == strength


def test_what_is_shown_is_by_style_and_as_strong_as_the_part():
    mixer = StyleMixer(4)
    for _ in range(180):
        mixer.step(StyleSpec({"spine": ("first", 0.5, "other", 0.25), "left_arm": "other"}))
    assert mixer.shown == {"first": [0, 0, 0.375, 0, 0], "other": [0, 0, 0.125, 1, 0]}
