"""Looking inside a session: what is seen is true, and the session goes on as if nobody had looked."""

from dataclasses import astuple

import numpy as np
import pytest

from demo import assemble
from demo.live.debug_overlay import GHOSTS, DebugOverlay
from demo.state.style_choice import StyleChoice
from sim.command import Command
from sim.motion.feature_window import SPAN
from tests.support.fakes import fake_session

FRAMES = 90
COMMAND = Command((0.6, 0.8), style={"left_arm": ("old", 1.0), "spine": ("proud", 1.0, "old", 0.5)})


@pytest.fixture(scope="module")
def looked_at():
    """A session whose every frame was looked at, the insight, and the frames."""
    session = assemble.build_session()
    debug_overlay, choice, frames = DebugOverlay(session), StyleChoice(session.stylizer.styles), []
    choice.pick("left_arm")
    for _ in range(FRAMES):
        frames.append(session.step(COMMAND))
        debug_overlay.follow(frames[-1])
        debug_overlay.paths()
        debug_overlay.past()
        debug_overlay.panels({"times", "phase", "attention"}, choice)
    return session, debug_overlay, frames


def test_nothing_in_the_session_knows_that_it_was_watched(looked_at):
    session = assemble.build_session()
    for frame in looked_at[2]:
        for ours, theirs in zip(astuple(frame.styled), astuple(session.step(COMMAND).styled), strict=True):
            np.testing.assert_array_equal(ours, theirs)


def test_the_way_asked_and_the_way_predicted_lead_where_the_stick_points(looked_at):
    _, debug_overlay, frames = looked_at
    paths, here = debug_overlay.paths(), frames[-1].neutral.root_position[[0, 2]]
    np.testing.assert_allclose(paths.past[-1], here, atol=1e-9)
    for way in (paths.desired, paths.predicted):
        ahead = way[-1] - here
        assert ahead @ [0.6, 0.8] > 0.95 * np.linalg.norm(ahead) > 0.5


def test_the_past_is_the_half_second_that_the_stylizer_is_given(looked_at):
    _, debug_overlay, frames = looked_at
    past = debug_overlay.past()
    newest = [frame.neutral for frame in frames[-SPAN:]]
    assert len(past) == GHOSTS and all(any(pose is other for other in newest) for pose in past)
    assert past[0] is newest[0] and past[-1] is not newest[-1]


def test_a_stand_in_without_these_is_not_an_error():
    session = fake_session()
    debug_overlay = DebugOverlay(session)
    debug_overlay.follow(session.step(Command()))
    assert debug_overlay.paths() is None
    (panel,) = debug_overlay.panels({"attention"}, StyleChoice(()))
    assert "no attention" in panel.widgets[1].text
