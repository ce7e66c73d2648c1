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


def test_what_has_arrived_rests_until_something_else_is_asked_or_done():
    mixer, asked = StyleMixer(4), StyleSpec({"spine": ("first", 0.5, "other", 0.25), "left_arm": "other"})
    for _ in range(180):
        mixer.step(asked)
    assert mixer.steady
    before = mixer.shown
    mixer.step(StyleSpec({"spine": ("first", 0.5, "other", 0.25), "left_arm": "other"}))  # the same in other words
    assert mixer.steady and mixer.shown == before
    mixer.step(StyleSpec({"left_arm": "other"}))
    assert not mixer.steady and 0 < mixer.strengths[SPINE] < 0.5


@pytest.mark.parametrize(
    "change", [StyleMixer.switch, lambda mixer: mixer.rename("other", "new"), lambda mixer: mixer.keep(["first"])]
)
def test_styles_that_change_otherwise_are_seen_in_the_next_step(change):
    mixer = StyleMixer(4)
    for _ in range(180):
        mixer.step(StyleSpec({"spine": "other"}))
    change(mixer)
    mixer.step(StyleSpec({"spine": "other"}))
    assert not mixer.steady and mixer.shown["other"][SPINE] > 0
